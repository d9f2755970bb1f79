#version 330 core
in vec4 nearness;
out vec4 pixel;

void main() {
    pixel = nearness;
}
