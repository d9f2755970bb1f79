#version 330 core
//include lighting.glsl
uniform float iris;      // radii, as shares of the eyeball's
uniform float pupil;
uniform mat3 head;       // axes of the head, in the world
uniform mat3 ball;       // axes of the eyeball, in the world
uniform vec3 lids[4];    // middles of upper and lower lid, outer and inner corner, in radii of the eyeball
uniform vec3 tint;       // of the iris
in vec3 place;
in vec3 normal;
in vec3 local;
out vec4 pixel;

const float CORNEA = 0.26;    // how far the cornea's centre lies in front of the eyeball's
const float DEEP = 0.02;      // how far the iris lies below the rim of the cornea

float grain(vec2 at) {
    return fract(sin(dot(at, vec2(12.9898, 78.233))) * 43758.5453);
}

float noise(float at) {
    float low = floor(at);
    float part = at - low;
    return mix(grain(vec2(low, 1.0)), grain(vec2(low + 1.0, 1.0)), part * part * (3.0 - 2.0 * part));
}

// Brightness of the fibres that run outwards from the pupil.
float fibres(float angle, float across) {
    float turn = angle * 6.3662;   // 40 fibres around the pupil
    float coarse = noise(turn + 50.0) * 0.5 + noise(turn * 2.3 + across * 1.5 + 90.0) * 0.3;
    return coarse + noise(turn * 5.0 + 190.0) * 0.2;
}

// Height of a lid's margin at x: a curve through the corners and its middle.
float margin(float x, vec3 middle) {
    vec3 corner = x > middle.x ? (lids[2].x > middle.x ? lids[2] : lids[3]) : (lids[2].x > middle.x ? lids[3] : lids[2]);
    float t = clamp((x - middle.x) / (corner.x - middle.x), 0.0, 1.0);
    return mix(middle.y, corner.y, t * t);
}

void main() {
    vec3 n = normalize(normal);
    vec3 view = normalize(eye - place);
    vec3 at = normalize(local);
    float rim = at.z > 0.0 ? length(at.xy) : 2.0;
    float cornea = 1.0 - smoothstep(iris * 0.92, iris * 1.16, rim);

    // The cornea refracts the line of sight to the iris; seen from the front, iris and pupil keep their sizes.
    vec3 bulge = normalize(at - vec3(0.0, 0.0, CORNEA));
    vec3 bend = normalize(mix(at, bulge, 0.7));
    vec3 bent = refract(-(transpose(ball) * view), bend, 1.0 / 1.336);
    vec3 straight = refract(vec3(0.0, 0.0, -1.0), bend, 1.0 / 1.336);
    float below = at.z + 0.05 * cornea - sqrt(1.0 - iris * iris) + DEEP;
    vec2 inside = at.xy + below * (bent.xy / max(-bent.z, 0.3) - straight.xy / max(-straight.z, 0.3));
    float r = mix(rim, length(inside), cornea);
    float soft = clamp(fwidth(rim) * 1.2, 0.012, 0.2);

    float angle = atan(inside.y, inside.x);
    float across = clamp((r - pupil) / max(iris - pupil, 1e-3), 0.0, 1.0);
    vec3 ring = mix(tint * vec3(1.75, 1.25, 0.75) + vec3(0.03, 0.014, 0.0), tint, smoothstep(0.1, 0.55, across));
    ring *= 0.45 + 1.1 * fibres(angle, across);
    ring *= 1.0 - 0.72 * smoothstep(0.72, 1.0, across);            // dark ring around the iris
    ring *= 0.55 + 0.45 * smoothstep(0.0, 0.12, across);           // and around the pupil
    vec3 base = mix(ring, vec3(0.004), 1.0 - smoothstep(pupil - soft, pupil + soft, r));
    vec3 in_head = transpose(head) * n;
    float aside = smoothstep(0.30, 0.95, abs(in_head.x));
    vec3 white = mix(vec3(0.66, 0.63, 0.61), vec3(0.60, 0.40, 0.36), aside * 0.75);
    // Towards the nose it is redder: there the eyeball's skin lies in a fold.
    white = mix(white, vec3(0.60, 0.33, 0.29), 0.7 * smoothstep(0.45, 0.85, in_head.x * sign(lids[3].x)));
    float edge = iris + soft;
    base = mix(base, white, smoothstep(edge - soft * 1.5 - 0.05, edge + soft * 1.5 + 0.03, rim));

    // Lids shade the eyeball, the upper one most.
    float under = margin(in_head.x, lids[0]) - in_head.y;
    float above = in_head.y - margin(in_head.x, lids[1]);
    float shade = smoothstep(-0.06, 0.50, under);
    float far = soft * 1.2;   // of a few pixels, dark edges would be all that is seen
    shade = mix(0.14 + far, 1.0, shade) * mix(0.45 + far, 1.0, smoothstep(-0.05, 0.20, above));
    shade *= 1.0 - (0.45 - far) * aside;
    // The iris is lit like a hollow: on the side away from the light.
    vec3 hollow = normalize(mix(n, normalize(n - 0.9 * (ball * vec3(at.xy, 0.0))), cornea));
    float key = max(dot(hollow, KEY_DIRECTION) * 0.75 + 0.25, 0.0);
    vec3 light = KEY * key * shade + (FILL * 0.8 + mix(FLOOR, SKY, 0.55) * 0.62) * (0.25 + 0.75 * shade);
    vec3 shown = base * light;

    // The wet surface reflects the key light's window and the studio.
    vec3 wet = normalize(mix(n, ball * bulge, cornea));
    vec3 mirrored = reflect(-view, wet);
    vec3 right = normalize(cross(vec3(0.0, 1.0, 0.0), KEY_DIRECTION));
    vec2 window = abs(vec2(dot(mirrored, right), dot(mirrored, cross(KEY_DIRECTION, right))));
    float side = clamp(fwidth(window.x) + fwidth(window.y), 0.03, 0.12);
    vec2 within = 1.0 - smoothstep(vec2(0.20 - side), vec2(0.20 + side), window);
    float spark = within.x * within.y * step(0.0, dot(mirrored, KEY_DIRECTION));
    float graze = 1.0 - max(dot(wet, view), 0.0);
    float fresnel = 0.03 + 0.6 * graze * graze * graze * graze;
    float lit = smoothstep(0.02, 0.10, under);
    shown += spark * mix(0.55, 1.7, cornea) * vec3(1.0, 0.97, 0.93) * lit;
    shown += mix(FLOOR, SKY, mirrored.y * 0.5 + 0.5) * fresnel * (0.3 + 0.7 * shade);
    // Tears stand along the lower lid.
    float tears = smoothstep(0.0, 0.02, above) * (1.0 - smoothstep(0.02, 0.055, above));
    shown += vec3(0.22) * tears * (1.0 - aside) * (0.4 + 0.6 * max(dot(n, KEY_DIRECTION), 0.0));
    pixel = vec4(encode(shown), 1.0);
}
