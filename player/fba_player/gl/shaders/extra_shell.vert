#version 330 core
uniform mat4 camera;
in vec3 in_position;
in vec3 in_normal;
out vec3 place;
out vec3 normal;

void main() {
    place = in_position;
    normal = in_normal;
    gl_Position = camera * vec4(in_position, 1.0);
}
