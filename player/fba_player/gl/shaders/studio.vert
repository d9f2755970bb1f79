#version 330 core
// The full picture behind everything: the backdrop, and the ground if there is one.
uniform mat4 unproject;
in vec2 in_corner;
out vec2 corner;
out vec3 near_;
out vec3 far_;

void main() {
    corner = in_corner;
    vec4 a = unproject * vec4(in_corner, -1.0, 1.0);
    vec4 b = unproject * vec4(in_corner, 1.0, 1.0);
    near_ = a.xyz / a.w;
    far_ = b.xyz / b.w;
    gl_Position = vec4(in_corner, 1.0, 1.0);
}
