#version 330 core
in vec2 at;
in float darkness;
out vec4 pixel;

void main() {
    pixel = vec4(0.0, 0.0, 0.0, darkness * 0.75 * max(exp(-dot(at, at) * 1.8) - 0.01, 0.0));
}
