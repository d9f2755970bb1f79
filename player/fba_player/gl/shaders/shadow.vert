#version 330 core
// Soft shadows on the ground: one instance per square.
uniform mat4 camera;
in vec2 in_corner;
in vec4 in_blob;     // x, z, radius, darkness
out vec2 at;
out float darkness;

void main() {
    at = in_corner * 1.6;
    darkness = in_blob.w;
    vec2 place = in_blob.xy + at * in_blob.z;
    gl_Position = camera * vec4(place.x, 0.0, place.y, 1.0);
}
