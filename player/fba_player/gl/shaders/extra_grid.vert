#version 330 core
// A level square around the grid's centre.
uniform mat4 camera;
uniform vec2 centre;
uniform float height;
uniform float reach;
in vec2 in_corner;        // -1 or 1 each
out vec2 at;

void main() {
    at = centre + in_corner * reach;
    gl_Position = camera * vec4(at.x, height, at.y, 1.0);
}
