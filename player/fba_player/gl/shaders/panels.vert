#version 330 core
uniform vec2 size; // of the display, in points
in vec2 in_place;
in vec2 in_texture;
in vec4 in_colour;
out vec2 texture_place;
out vec4 colour;

void main() {
    texture_place = in_texture;
    colour = in_colour;
    gl_Position = vec4(2.0 * in_place.x / size.x - 1.0, 1.0 - 2.0 * in_place.y / size.y, 0.0, 1.0);
}
