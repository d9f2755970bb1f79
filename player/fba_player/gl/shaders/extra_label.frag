#version 330 core
uniform sampler2D words;
in vec2 texture_at;
out vec4 pixel;

void main() {
    pixel = texture(words, texture_at);
}
