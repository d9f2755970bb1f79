#version 330 core
// Some vertices of a body: their places in the world, and normals from their neighbours' places.
//include gpu_tables.glsl
//include gpu_carry.glsl
uniform sampler2D moved;     // places of all vertices, from the root
uniform vec3 root;
in int in_row;
in ivec4 in_around;          // neighbours; below 0: the normal only turns
in vec3 in_numbers;          // what makes a normal of them
in vec3 in_upright;
in ivec4 in_joints;
in vec4 in_weights;
out vec3 position;
out vec3 normal;

vec3 place(int row) {
    return texelFetch(moved, cell(row), 0).xyz;
}

void main() {
    position = place(in_row) + root;
    if (in_around.x < 0) {
        Blend blend = blended(in_joints, in_weights);
        normal = turned(in_upright, blend.turn, per(blend.turn));
        return;
    }
    vec3 t = place(in_around.x) - place(in_around.z);
    vec3 u = place(in_around.y) - place(in_around.w);
    normal = in_numbers.x * t + in_numbers.y * u + in_numbers.z * cross(t, u);
    float squared = dot(normal, normal);
    normal *= squared > 1e-30 ? inversesqrt(squared) : 1.0;
}
