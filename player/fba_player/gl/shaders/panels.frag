#version 330 core
uniform sampler2D picture;
in vec2 texture_place;
in vec4 colour;
out vec4 shown;

void main() {
    shown = colour * texture(picture, texture_place);
}
