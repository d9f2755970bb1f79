// A studio: a large warm key light from the upper left, a cool fill, a rim light from behind, and a
// dome that is brighter above than below. Everything in linear light; `encode` turns it into sRGB.
uniform vec3 eye;

const vec3 KEY_DIRECTION = normalize(vec3(0.70, 0.68, 0.80));
const vec3 FILL_DIRECTION = normalize(vec3(-0.9, 0.15, 0.6));
const vec3 RIM_DIRECTION = normalize(vec3(-0.55, 0.50, -0.85));
const vec3 KEY = vec3(1.78, 1.66, 1.53);
const vec3 FILL = vec3(0.27, 0.275, 0.29);
const vec3 RIM = vec3(0.76, 0.80, 0.86);
const vec3 SKY = vec3(0.46, 0.47, 0.50);
const vec3 FLOOR = vec3(0.20, 0.175, 0.16);

// Linear light to sRGB: highlights roll off, then a curve within 1/170 of the standard's, by one root.
vec3 encode(vec3 linear) {
    vec3 light = max(linear, 0.0);
    vec3 toned = light * (1.0 + light * 0.06) / (1.0 + light * 0.5);
    return max(1.23460 * sqrt(toned) - 0.21734 * toned - 0.02316, 0.0);
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

// sRGB to linear light, by a cubic: within 1/200 of the curve.
vec3 decode(vec3 code) {
    return code * (code * (code * 0.305306011 + 0.682171111) + 0.012522878);
}

// What a surface that mirrors (GGX, Kelemen's visibility) sends of a light. nv, nl, vl: cosines between
// normal, view and light; sharp, soft: squares of the two lobes' widths.
float mirrored(float nv, float nl, float vl, float sharp, float soft) {
    float hh = 2.0 + 2.0 * vl;                      // square of view + light
    float nh2 = min((nv + nl) * (nv + nl) / max(hh, 0.1), 1.0);
    float a = nh2 * (sharp - 1.0) + 1.0;
    float b = nh2 * (soft - 1.0) + 1.0;
    a *= a;
    b *= b;
    float off = 1.0 - hh * 0.25;                    // Schlick's Fresnel term, by the square of its cosine
    off *= off;
    off *= off;
    float fresnel = 0.028 + 0.95 * off * off;
    return fresnel * nl * (0.75 * soft * a + 0.25 * sharp * b) / (a * b * max(hh, 0.9));
}

// What a surface shows of the studio. n: normal; fine: with the relief of pores, for what is mirrored;
// reach: what reaches it of the key light, the open sky, through it from behind, of the rim light.
vec3 surface(vec3 view, vec3 n, vec3 fine, vec3 albedo, float gloss, vec4 reach, float scatter) {
    // Light that wanders below the surface softens the edge of the shade, the red most.
    vec3 wander = vec3(0.24, 0.12, 0.08) * scatter;
    vec3 key = clamp((dot(n, KEY_DIRECTION) + wander) / (1.0 + wander), 0.0, 1.0);
    key *= 1.0 - wander + wander * key;
    key *= reach.x * (1.0 + (1.0 - reach.x) * vec3(0.34, 0.10, 0.0) * scatter);
    // Light bounces on in folds, and through flesh, which leaves the red of it.
    vec3 open = reach.y * (1.0 + (1.0 - reach.y) * 0.85 * albedo);
    open += (1.0 - reach.y) * vec3(0.24, 0.10, 0.085) * scatter;
    vec3 dome = FILL * max(dot(n, FILL_DIRECTION) * 0.7 + 0.3, 0.0) + mix(FLOOR, SKY, n.y * 0.5 + 0.5) * 0.62;
    float rim = max(dot(n, RIM_DIRECTION), 0.0) * reach.w;
    vec3 diffuse = KEY * key + dome * open + RIM * (rim + vec3(1.5, 0.32, 0.16) * (reach.z * scatter));
    // Mirrored: the skin, and an oily film on it.
    float nv = max(dot(fine, view), 0.02);
    float rough = clamp(1.0 - gloss, 0.12, 1.0);
    float soft = rough * rough * rough * rough;
    float sharp = soft * 0.16 + 0.0004;
    float nl = max(dot(fine, KEY_DIRECTION), 0.0);
    float bl = max(dot(n, RIM_DIRECTION), 0.0);
    vec3 shine = KEY * (mirrored(nv, nl, dot(view, KEY_DIRECTION), sharp, soft) * reach.x);
    shine += RIM * (mirrored(nv, bl, dot(view, RIM_DIRECTION), soft, soft) * reach.w * 0.6);
    float graze = 1.0 - nv;
    graze *= graze;
    float around = (0.028 + 0.8 * graze * graze) * (1.0 - 0.6 * rough) * reach.y * reach.y;
    float up = 2.0 * dot(fine, view) * fine.y - view.y;
    return albedo * diffuse + shine + mix(FLOOR, SKY, clamp(up * 0.5 + 0.5, 0.0, 1.0)) * around;
}
