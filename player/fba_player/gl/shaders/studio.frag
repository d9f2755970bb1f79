#version 330 core
//include lighting.glsl
uniform float ground;          // 1 where there is a ground
uniform vec2 centre;           // where the ground is brightest, x and z
uniform mat4 unproject;
uniform vec2 size;             // pixels
out vec4 pixel;

float line(float at, float wide) {
    float away = abs(fract(at - 0.5) - 0.5);
    float width = fwidth(at) * wide;
    return (1.0 - smoothstep(width * 0.5, width * 1.5, away)) * clamp(0.35 / max(width, 1e-4), 0.0, 1.0);
}

void main() {
    vec2 corner = gl_FragCoord.xy / size * 2.0 - 1.0;  // varyings would differ in the last bit with samples
    vec4 nearest = unproject * vec4(corner, -1.0, 1.0), furthest = unproject * vec4(corner, 1.0, 1.0);
    vec3 near_ = nearest.xyz / nearest.w, far_ = furthest.xyz / furthest.w;
    vec3 backdrop = mix(vec3(0.155, 0.165, 0.185), vec3(0.42, 0.44, 0.475), smoothstep(-1.1, 1.0, corner.y));
    backdrop *= 1.0 - 0.30 * dot(corner, corner) * 0.5;
    vec3 colour = backdrop;
    if (ground > 0.5) {
        vec3 ray = far_ - near_;
        float down = -ray.y;
        float t = down > 1e-5 ? near_.y / down : -1.0;
        vec2 at = near_.xz + ray.xz * max(t, 0.0);
        float reach = length(at - centre);
        float seen = t > 0.0 ? 1.0 - smoothstep(1.2, 5.5, reach) : 0.0;
        vec3 floor_ = mix(vec3(0.36, 0.37, 0.39), vec3(0.24, 0.25, 0.27), smoothstep(0.0, 5.0, reach));
        float lines = max(line(at.x * 2.0, 1.0), line(at.y * 2.0, 1.0)) * 0.35;
        lines = max(lines, max(line(at.x * 0.5, 1.2), line(at.y * 0.5, 1.2)) * 0.6);
        floor_ = mix(floor_, vec3(0.50, 0.52, 0.55), lines * 0.55);
        colour = mix(colour, floor_, seen);
    }
    // Half a step of noise hides the bands of a slow gradient in 8 bits.
    float grain = fract(sin(dot(gl_FragCoord.xy, vec2(12.9898, 78.233))) * 43758.5453) - 0.5;
    pixel = vec4(encode(colour) + grain / 255.0, 1.0);
}
