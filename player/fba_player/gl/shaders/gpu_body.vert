#version 330 core
// Some vertices of a body: their places in the world, and normals. LIT: and the light that reaches them.
//include gpu_tables.glsl
//include gpu_carry.glsl
//include gpu_surface.glsl
uniform vec3 root;
in int in_row;
in ivec4 in_around;
in vec3 in_numbers;
in vec3 in_upright;
in ivec4 in_joints;
in vec4 in_weights;
out vec3 position;
out vec3 normal;
#ifdef LIT
uniform sampler2D past;      // what comes past the limbs to some of the vertices: of the key light, of the sky
uniform vec4 reach;          // where nothing is in the way: of key light, sky, through the skin, rim light
in ivec3 in_near;            // of these, those from which it is taken
in vec3 in_shares;
in float in_folds;           // how much of the sky the body's own folds leave
out vec4 light;
#endif

void main() {
    position = place(in_row) + root;
    normal = upright(in_around, in_numbers, in_upright, in_joints, in_weights);
#ifdef LIT
    vec2 comes = vec2(0.0);
    for (int k = 0; k < 3; ++k) comes += in_shares[k] * texelFetch(past, cell(in_near[k]), 0).xy;
    comes.y *= in_folds;
    light = reach * vec4(comes.x, comes.y, 1.0, comes.y);
#endif
}
