// A studio: a large warm key light from the upper left, a cool fill, a soft light and a rim light from behind,
// and a dome that is brighter above than below. Everything in linear light; `encode` turns it into sRGB.
uniform vec3 eye;

const vec3 KEY_DIRECTION = normalize(vec3(0.70, 0.68, 0.80));
// Axes of the map of what is before the key light.
const vec3 ACROSS = normalize(vec3(0.80, 0.0, -0.70));
const mat2x3 BEFORE = mat2x3(ACROSS, cross(KEY_DIRECTION, ACROSS));
const float HIGHEST = 4.0;  // metres: range of the map of what is near the ground
const vec3 FILL_DIRECTION = normalize(vec3(-0.9, 0.15, 0.6));
const vec3 BACK_DIRECTION = normalize(vec3(0.45, 0.35, -0.95));
const vec3 RIM_DIRECTION = normalize(vec3(-0.55, 0.50, -0.85));
const vec3 KEY = vec3(1.78, 1.66, 1.53);
const vec3 FILL = vec3(0.27, 0.275, 0.29);
const vec3 BACK = vec3(0.46, 0.46, 0.48);
const vec3 RIM = vec3(0.76, 0.80, 0.86);
const vec3 SKY = vec3(0.46, 0.47, 0.50);
const vec3 FLOOR = vec3(0.20, 0.175, 0.16);

// Linear light to sRGB: highlights roll off, then sRGB's curve, within 1/170, by a single square root.
vec3 encode(vec3 linear) {
    vec3 light = max(linear, 0.0);
    vec3 toned = light * (1.0 + light * 0.06) / (1.0 + light * 0.5);
    return max(1.23460 * sqrt(toned) - 0.21734 * toned - 0.02316, 0.0);
}

float power(float x, int doublings) {
    for (int i = 0; i < doublings; ++i) x *= x;
    return x;
}

// Light from a simple surface. colour.a: gloss, 0 for cloth, more for skin, which is redder where light ends.
vec3 lit(vec3 place, vec3 normal, vec4 colour) {
    vec3 view = normalize(eye - place);
    vec3 n = dot(normal, view) < 0.0 ? -normal : normal;
    float key = dot(n, KEY_DIRECTION);
    vec3 wrap = mix(vec3(0.12), vec3(0.34, 0.17, 0.12), min(colour.a * 2.5, 1.0));
    vec3 diffuse = KEY * max((vec3(key) + wrap) / (1.0 + wrap), 0.0) * 0.80;
    diffuse += FILL * max(dot(n, FILL_DIRECTION) * 0.75 + 0.25, 0.0) + BACK * max(dot(n, BACK_DIRECTION), 0.0);
    diffuse += mix(FLOOR, SKY, n.y * 0.5 + 0.5) * 0.52;
    vec3 halfway = normalize(KEY_DIRECTION + view);
    float facing = max(dot(n, view), 0.0);
    float fresnel = power(1.0 - facing, 2);
    float mirror = power(max(dot(n, halfway), 0.0), 4);
    float gloss = colour.a * (mirror * 0.16 + mirror * mirror * mirror * mirror * 0.08);
    vec3 rim = RIM * fresnel * max(dot(n, RIM_DIRECTION) + 0.35, 0.0) * 0.7;
    return colour.rgb * diffuse + KEY * gloss * step(0.0, key) + rim * (0.25 + colour.rgb);
}

// Square of the width of a surface's reflections; gloss: 0 dull .. 1 sharp.
float widths(float gloss) {
    float rough = clamp(1.0 - gloss, 0.12, 1.0);
    rough *= rough;
    return rough * rough;
}

// Strength of a reflection (GGX) from the squared cosine between the normal and the direction halfway between
// eye and light: that of the skin, and of an oily film on it.
float lobes(float nh2, float soft) {
    float sharp = soft * 0.16 + 0.0004;
    float a = nh2 * (soft - 1.0) + 1.0;
    float b = nh2 * (sharp - 1.0) + 1.0;
    return 0.75 * soft / (a * a) + 0.25 * sharp / (b * b);
}

// Share of a light that is reflected: Schlick's Fresnel term and Kelemen's visibility.
float mirrored(float nl, float vl) {
    float hh = 2.0 + 2.0 * vl;                      // square of view + light
    float off = max(1.0 - hh * 0.25, 0.0);
    off *= off;
    off *= off;
    return (0.028 + 0.95 * off * off) * nl / max(hh, 0.9);
}

// Hair on a scalp, which has no gloss, does not shine as a whole: that would be a grey veil on it.
float veil(float gloss) {
    return min(0.25 + gloss * 20.0, 1.0);
}

float mirrored_key(vec3 view, vec3 n, float gloss, vec4 reach) {
    return mirrored(max(dot(n, KEY_DIRECTION), 0.0), dot(view, KEY_DIRECTION)) * veil(gloss) * reach.x;
}

const vec3 AROUND = vec3(0.44, 0.45, 0.48);

// Reflections of the rim light and of the studio, as a share of AROUND.
float mirrored_around(vec3 view, vec3 n, float gloss, vec4 reach) {
    float nv = max(dot(n, view), 0.02);
    float rl = max(dot(n, RIM_DIRECTION), 0.0);
    float vl = dot(view, RIM_DIRECTION);
    float nh2 = min((nv + rl) * (nv + rl) / max(2.0 + 2.0 * vl, 0.1), 1.0);
    float soft = widths(gloss);
    float a = nh2 * (soft - 1.0) + 1.0;
    float rim = mirrored(rl, vl) * soft / (a * a) * veil(gloss) * reach.w * 1.1;
    float rough = clamp(1.0 - gloss, 0.12, 1.0);
    float graze = 1.0 - nv;
    graze *= graze;
    float up = 2.0 * nv * n.y - view.y;
    float sky = mix(0.41, 1.05, clamp(up * 0.5 + 0.5, 0.0, 1.0));
    return rim + sky * (0.028 + 0.8 * graze * graze) * (1.0 - 0.6 * rough) * reach.y * reach.y;
}

// Shares of the key light's reflections and of those around that are left on dark surfaces, such as hair: light
// is lost among its strands, most of all where it grazes them.
vec2 unlost(vec3 albedo) {
    return mix(vec2(0.35, 0.15), vec2(1.0), smoothstep(0.02, 0.24, max(albedo.r, max(albedo.g, albedo.b))));
}

// Diffuse light from a surface in the studio, without its colour. n: normal; reach: shares of light that reach
// it: key light, open sky, through the skin from behind, rim light; scatter: 1 skin, 0 cloth.
vec3 diffuse(vec3 n, vec3 albedo, vec4 reach, float scatter) {
    // Scattering below the surface softens the edge of the shade, most of all in red.
    vec3 spread = vec3(0.24, 0.15, 0.11) * scatter;
    vec3 key = clamp((dot(n, KEY_DIRECTION) + spread) / (1.0 + spread), 0.0, 1.0);
    key *= 1.0 - spread + spread * key;
    key *= reach.x * (1.0 + (1.0 - reach.x) * vec3(0.16, 0.05, 0.0) * scatter);
    // In folds, light is reflected again, and red light passes through flesh.
    vec3 open = reach.y * (1.0 + (1.0 - reach.y) * 0.85 * albedo);
    open += (1.0 - reach.y) * vec3(0.24, 0.10, 0.085) * scatter;
    vec3 dome = (FILL + vec3(0.06, 0.05, 0.04) * scatter) * max(dot(n, FILL_DIRECTION) * 0.7 + 0.3, 0.0);
    dome += mix(FLOOR, SKY, n.y * 0.5 + 0.5) * 0.62;
    float rim = max(dot(n, RIM_DIRECTION), 0.0) * reach.w;
#ifdef LIMBS
    // Clothes of a body get more of the key light and of that from behind, and less of the rest: folds show.
    float cloth = 1.0 - scatter;
    key *= 1.0 + cloth * (0.22 - 0.6 * (1.0 - reach.y));
    dome *= 1.0 - 0.38 * cloth;
    rim *= 1.0 + 1.6 * cloth;
#endif
    dome += BACK * max(dot(n, BACK_DIRECTION), 0.0);
    return KEY * key + dome * open + RIM * (rim + vec3(1.5, 0.32, 0.16) * (reach.z * scatter));
}

#ifdef SHADED
// Shadows that bodies throw on bodies.
uniform sampler2D tops;   // along the key light: what share is covered, height of what it reaches first, its square

// Share of the key light at a place in that map and a height, from mean and variance of the heights around: at most
// this share of them is not above. Little of that comes from heights that differ by more than one surface can. Less
// is hidden where little around is covered: at an outline of the body, seen from the light.
float unshaded(vec3 before) {
    vec2 aside = vec2(1.2, 0.6) / float(textureSize(tops, 1).x);
    vec3 seen = textureLod(tops, before.xy + aside, 2.0).rgb + textureLod(tops, before.xy - aside, 2.0).rgb;
    vec2 mean = seen.yz / max(seen.x, 1e-3);
    float above = max(mean.x - before.z, 0.0), spread = max(mean.y - mean.x * mean.x, 2e-4);
    float hidden = 0.84 * clamp(1.0 - (spread / (spread + above * above) - 0.3) * 1.43, 0.0, 1.0);
    return 1.0 - hidden * min(seen.x, 1.0);
}
#endif
