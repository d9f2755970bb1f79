#version 330 core
uniform sampler2D picture;
in vec2 texture_at;
out vec4 pixel;

void main() {
    pixel = texture(picture, texture_at);
}
