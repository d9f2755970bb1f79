#version 330 core
uniform mat4 world;
uniform mat4 camera;
in vec3 in_position;
in vec3 in_normal;
in vec4 in_colour;
out vec3 place;
out vec3 normal;
out vec4 colour;

void main() {
    vec4 at = world * vec4(in_position, 1.0);
    place = at.xyz;
    normal = mat3(world) * in_normal;
    colour = in_colour;
    gl_Position = camera * at;
}
