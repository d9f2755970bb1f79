#version 330 core
// One instance per line: two triangles a pixel wider than the line on each side, for smooth edges.
uniform mat4 camera;
uniform vec3 eye;
uniform vec2 size;        // of the picture, pixels
uniform float width;      // pixels
uniform float lift;       // metres towards the eye
in vec2 in_corner;        // 0 or 1: which end; -1 or 1: which side
in vec3 in_from;
in vec3 in_to;
in vec4 in_from_colour;
in vec4 in_to_colour;
out vec4 colour;
out float across;         // pixels from the middle
out float span;           // the line's length, pixels

vec4 lifted(vec3 at) {
    vec4 flat_ = camera * vec4(at, 1.0);
    vec3 way = eye - at;
    vec4 nearer = camera * vec4(at + way * min(lift / max(length(way), 1e-6), 0.5), 1.0);
    flat_.z = nearer.z / nearer.w * flat_.w;
    return flat_;
}

void main() {
    vec4 a = lifted(in_from);
    vec4 b = lifted(in_to);
    colour = mix(in_from_colour, in_to_colour, in_corner.x);
    across = in_corner.y * (width * 0.5 + 1.0);
    if (a.w < 1e-4 || b.w < 1e-4) {  // behind the camera
        span = 0.0;
        gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
        return;
    }
    vec2 way = (b.xy / b.w - a.xy / a.w) * size * 0.5;
    span = length(way);
    vec2 side = span > 1e-4 ? vec2(-way.y, way.x) / span : vec2(0.0, 1.0);
    vec4 at = in_corner.x < 0.5 ? a : b;
    at.xy += side * across * 2.0 / size * at.w;
    gl_Position = at;
}
