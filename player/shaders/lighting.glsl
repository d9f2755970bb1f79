// A studio: a large warm key light from the upper left, a cool fill, a rim light from behind, and a
// dome that is brighter above than below. Everything in linear light; `encode` turns it into sRGB.
uniform vec3 eye;

const vec3 KEY_DIRECTION = normalize(vec3(0.55, 0.75, 0.85));
const vec3 FILL_DIRECTION = normalize(vec3(-0.9, 0.15, 0.6));
const vec3 RIM_DIRECTION = normalize(vec3(-0.5, 0.55, -1.0));
const vec3 KEY = vec3(1.62, 1.53, 1.42);
const vec3 FILL = vec3(0.26, 0.31, 0.38);
const vec3 RIM = vec3(0.55, 0.60, 0.68);
const vec3 SKY = vec3(0.50, 0.53, 0.58);
const vec3 FLOOR = vec3(0.24, 0.21, 0.19);

// Linear light to sRGB, by roots: within 1/500 of the curve, at a fraction of the cost of pow.
vec3 encode(vec3 linear) {
    vec3 toned = max(linear / (1.0 + 0.16 * linear), 0.0);
    vec3 root = sqrt(toned);
    vec3 fourth = sqrt(root);
    vec3 curve = 0.662002687 * root + 0.684122060 * fourth - 0.323583601 * sqrt(fourth) - 0.0225411470 * toned;
    return max(curve, 0.0);
}

float power(float x, int doublings) {
    for (int i = 0; i < doublings; ++i) x *= x;
    return x;
}

// colour.a: 0 cloth, towards 1 skin with a sheen; skin also lets red light through at its terminator.
vec3 lit(vec3 place, vec3 normal, vec4 colour) {
    vec3 view = normalize(eye - place);
    vec3 n = dot(normal, view) < 0.0 ? -normal : normal;
    float key = dot(n, KEY_DIRECTION);
    vec3 wrap = mix(vec3(0.12), vec3(0.34, 0.17, 0.12), min(colour.a * 2.5, 1.0));
    vec3 diffuse = KEY * max((vec3(key) + wrap) / (1.0 + wrap), 0.0) * 0.80;
    diffuse += FILL * max(dot(n, FILL_DIRECTION) * 0.75 + 0.25, 0.0);
    diffuse += mix(FLOOR, SKY, n.y * 0.5 + 0.5) * 0.52;
    vec3 halfway = normalize(KEY_DIRECTION + view);
    float facing = max(dot(n, view), 0.0);
    float fresnel = power(1.0 - facing, 2);
    float mirror = power(max(dot(n, halfway), 0.0), 4);
    float gloss = colour.a * (mirror * 0.16 + mirror * mirror * mirror * mirror * 0.08);
    vec3 rim = RIM * fresnel * max(dot(n, RIM_DIRECTION) + 0.35, 0.0) * 0.7;
    return colour.rgb * diffuse + KEY * gloss * step(0.0, key) + rim * (0.25 + colour.rgb);
}
