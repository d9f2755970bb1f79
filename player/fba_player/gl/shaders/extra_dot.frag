#version 330 core
uniform vec4 colour;
uniform float radius;
uniform float opacity;
in vec2 from_middle;
out vec4 pixel;

void main() {
    float away = length(from_middle);
    float rim = clamp(radius * 0.28, 0.4, 1.2);
    float inside = clamp(radius + 0.5 - away, 0.0, 1.0);
    float all = clamp(radius + rim + 0.5 - away, 0.0, 1.0);
    pixel = vec4(colour.rgb * inside / max(all, 1e-3), all * colour.a * opacity * mix(0.75, 1.0, inside));
}
