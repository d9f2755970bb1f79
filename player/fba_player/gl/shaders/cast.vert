#version 330 core
// The shadow that bodies cast on the ground.
uniform mat4 camera;
uniform vec2 low;     // x and z of its corner
uniform float width;  // metres
uniform vec4 part;    // where the dark part of it begins, and its size, as shares of these
in vec2 in_corner;
out vec2 at;

void main() {
    at = part.xy + part.zw * (in_corner * 0.5 + 0.5);
    vec2 place = low + width * at;
    gl_Position = camera * vec4(place.x, 0.0, place.y, 1.0);
}
