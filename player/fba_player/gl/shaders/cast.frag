#version 330 core
uniform sampler2D darkness;
in vec2 at;
out vec4 pixel;

void main() {
    pixel = vec4(0.0, 0.0, 0.0, texture(darkness, at).r);
}
