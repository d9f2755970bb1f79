#version 330 core
// One instance per dot: a square around a point, of the same size near and far.
uniform mat4 camera;
uniform vec3 eye;
uniform vec2 size;        // of the picture, pixels
uniform float radius;     // pixels
uniform float lift;       // metres towards the eye
in vec2 in_corner;        // -1 or 1 each
in vec3 in_place;
out vec2 from_middle;     // pixels

void main() {
    vec4 at = camera * vec4(in_place, 1.0);
    vec3 way = eye - in_place;
    vec4 nearer = camera * vec4(in_place + way * min(lift / max(length(way), 1e-6), 0.5), 1.0);
    at.z = nearer.z / nearer.w * at.w;
    from_middle = in_corner * (radius + 2.5);
    at.xy += from_middle * 2.0 / size * at.w;
    gl_Position = at;
}
