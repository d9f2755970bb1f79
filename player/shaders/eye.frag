#version 330 core
//include lighting.glsl
uniform float iris;
uniform float pupil;
uniform float lid;
uniform vec3 up;      // of the head, in the world
in vec3 place;
in vec3 normal;
in vec3 local;
out vec4 pixel;

float spokes(float angle) {
    return 0.5 + 0.28 * sin(angle * 23.0 + sin(angle * 7.0) * 2.0) + 0.22 * sin(angle * 61.0 + 1.3);
}

void main() {
    vec3 n = normalize(normal);
    vec3 view = normalize(eye - place);
    float r = local.z > 0.0 ? length(local.xy) : 2.0;
    float soft = max(fwidth(r) * 1.2, 0.012);
    float angle = atan(local.y, local.x);
    vec3 white = mix(vec3(0.78, 0.76, 0.74), vec3(0.70, 0.52, 0.48), smoothstep(0.62, 1.0, r) * 0.55);
    float across = clamp((r - pupil) / max(iris - pupil, 1e-3), 0.0, 1.0);
    vec3 ring = mix(vec3(0.17, 0.11, 0.055), vec3(0.055, 0.13, 0.16), smoothstep(0.05, 0.75, across));
    ring *= 0.65 + 0.75 * spokes(angle) * (1.0 - 0.5 * across);
    ring *= 1.0 - 0.8 * smoothstep(0.72, 1.0, across);
    // Light that enters from the key side gathers on the far side of the iris.
    ring *= 1.0 + 1.1 * max(dot(normalize(vec3(local.xy, 0.001)), normalize(vec3(-0.5, -0.8, 0.0))), 0.0);
    vec3 base = mix(ring, vec3(0.006), 1.0 - smoothstep(pupil - soft, pupil + soft, r));
    base = mix(base, white, smoothstep(iris - soft * 1.5, iris + soft * 1.5, r));
    float height = dot(n, up);
    float shade = mix(0.34, 1.0, smoothstep(0.02, 0.42, lid - height)) * mix(0.75, 1.0, smoothstep(-0.62, -0.3, height));
    float key = max(dot(n, KEY_DIRECTION) * 0.7 + 0.3, 0.0);
    vec3 light = (KEY * key * 0.62 + FILL + mix(FLOOR, SKY, 0.6) * 0.55) * shade;
    vec3 halfway = normalize(KEY_DIRECTION + view);
    float spark = smoothstep(0.9905, 0.9945, dot(n, halfway)) * 0.95;
    vec3 second = normalize(FILL_DIRECTION + view);
    spark += smoothstep(0.986, 0.996, dot(n, second)) * 0.10;
    pixel = vec4(encode(base * light + spark * smoothstep(0.0, 0.25, shade)), 1.0);
}
