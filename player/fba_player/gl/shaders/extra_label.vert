#version 330 core
// Rectangles of pixels, each with a part of a texture.
uniform vec2 size;        // of the picture, pixels
in vec2 in_corner;        // 0 or 1 each, from the upper left
in vec4 in_box;           // left, top, width, height in the picture, pixels
in vec4 in_part;          // the same in the texture, 0..1
out vec2 texture_at;

void main() {
    vec2 at = (in_box.xy + in_corner * in_box.zw) / size * 2.0 - 1.0;
    texture_at = in_part.xy + in_corner * in_part.zw;
    gl_Position = vec4(at.x, -at.y, 0.0, 1.0);
}
