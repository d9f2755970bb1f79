#version 330 core
//include lighting.glsl
// Triangles thrown onto the ground: the first instance along the key light, the second straight down.
uniform vec2 low;      // x and z of the corner of the ground
uniform float width;   // metres of ground
in vec3 in_position;   // in the world
out vec4 nearness;     // 1 on the ground, less above it, and that there is something; along each light
out float top;         // height along the key light, whose greatest it reaches first

void main() {
    float high = max(in_position.y, 0.0);
    float key = gl_InstanceID == 0 ? 1.0 : 0.0;
    vec2 ground = in_position.xz - key * high * SHADOW_STEP;
    vec2 seen = vec2(max(1.0 - high / HIGHEST, 0.01), 1.0);
    nearness = vec4(seen * key, seen * (1.0 - key));
    top = high * key;
    gl_Position = vec4((ground - low) / width * 2.0 - 1.0, 0.0, 1.0);
}
