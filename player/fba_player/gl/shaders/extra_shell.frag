#version 330 core
// A shell of glass: clear where it faces the eye, milky at its edges.
uniform vec3 eye;
in vec3 place;
in vec3 normal;
out vec4 pixel;

void main() {
    vec3 view = normalize(eye - place);
    vec3 n = normalize(normal);
    float edge = 1.0 - abs(dot(n, view));
    float lit = max(dot(n, normalize(vec3(0.70, 0.68, 0.80))), 0.0);
    vec3 colour = mix(vec3(0.62, 0.68, 0.76), vec3(0.88, 0.92, 0.97), 0.6 * edge + 0.35 * lit);
    pixel = vec4(colour, 0.15 + 0.16 * lit + 0.70 * edge * edge * edge);
}
