#version 330 core
uniform vec2 size;   // of the picture, pixels
in vec2 in_place;    // pixels from the upper left
in vec2 in_texture;
out vec2 texture_at;

void main() {
    texture_at = in_texture;
    gl_Position = vec4(in_place.x / size.x * 2.0 - 1.0, 1.0 - in_place.y / size.y * 2.0, 0.0, 1.0);
}
