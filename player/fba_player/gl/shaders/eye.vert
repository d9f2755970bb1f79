#version 330 core
uniform mat4 world;
uniform mat4 camera;
in vec3 in_position;
out vec3 place;
out vec3 normal;
out vec3 local;

void main() {
    vec4 at = world * vec4(in_position, 1.0);
    place = at.xyz;
    normal = mat3(world) * in_position;
    local = in_position;
    gl_Position = camera * at;
}
