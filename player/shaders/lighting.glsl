// A studio: a large warm key light from the upper left, a cool fill, a rim light from behind, and a
// dome that is brighter above than below. Everything in linear light; `encode` turns it into sRGB.
uniform vec3 eye;

const vec3 KEY_DIRECTION = normalize(vec3(0.70, 0.68, 0.80));
const vec3 FILL_DIRECTION = normalize(vec3(-0.9, 0.15, 0.6));
const vec3 RIM_DIRECTION = normalize(vec3(-0.55, 0.50, -0.85));
const vec3 KEY = vec3(1.78, 1.66, 1.53);
const vec3 FILL = vec3(0.22, 0.25, 0.30);
const vec3 RIM = vec3(0.80, 0.86, 0.95);
const vec3 SKY = vec3(0.44, 0.46, 0.50);
const vec3 FLOOR = vec3(0.17, 0.15, 0.14);

// Linear light to sRGB, by roots: within 1/500 of the curve, at a fraction of the cost of pow.
vec3 encode(vec3 linear) {
    vec3 light = max(linear, 0.0);
    vec3 toned = light * (1.0 + light * 0.06) / (1.0 + light * 0.5);   // highlights roll off
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

// sRGB to linear light, by a cubic: within 1/200 of the curve.
vec3 decode(vec3 code) {
    return code * (code * (code * 0.305306011 + 0.682171111) + 0.012522878);
}

// A lobe of light mirrored by a rough surface (GGX), without the Fresnel term. Large lights widen it.
float lobe(float rough, float nh, float nl, float nv) {
    float a = rough * rough;
    float a2 = a * a;
    float d = nh * nh * (a2 - 1.0) + 1.0;
    float k = 0.5 * a;
    float visible = (nl * (1.0 - k) + k) * (nv * (1.0 - k) + k);
    return a2 / (12.566 * d * d * visible);
}

// What a surface shows of the studio. n: normal; fine: with the relief of pores, for what is mirrored;
// reach: what reaches it of the key light, the open sky, through it from behind, of the rim light.
vec3 surface(vec3 place, vec3 n, vec3 fine, vec3 albedo, float gloss, vec4 reach, float scatter) {
    vec3 view = normalize(eye - place);
    float nv = max(dot(fine, view), 0.02);
    // Light that wanders below the surface softens the edge of the shade, the red most.
    vec3 wander = vec3(0.36, 0.15, 0.09) * scatter;
    vec3 key = clamp((vec3(dot(n, KEY_DIRECTION)) + wander) / (1.0 + wander), 0.0, 1.0);
    key = mix(key, key * key, wander);
    vec3 shade = mix(vec3(reach.x), vec3(reach.x * (2.0 - reach.x)), vec3(0.55, 0.12, 0.0) * scatter);
    vec3 open = reach.y / (reach.y + (1.0 - reach.y) * (1.0 - albedo * 0.75));  // light bounced in folds
    vec3 diffuse = KEY * key * shade;
    diffuse += FILL * max(dot(n, FILL_DIRECTION) * 0.7 + 0.3, 0.0) * open;
    diffuse += mix(FLOOR, SKY, n.y * 0.5 + 0.5) * 0.62 * open;
    diffuse += RIM * max(dot(n, RIM_DIRECTION), 0.0) * reach.w;
    diffuse += RIM * vec3(1.5, 0.32, 0.16) * reach.z * scatter;
    // Mirrored: the oily film and the skin beneath it.
    float rough = clamp(1.0 - gloss, 0.12, 1.0);
    float graze = 1.0 - nv;
    float graze2 = graze * graze;
    float fresnel = 0.028 + 0.972 * graze2 * graze2 * graze * (1.0 - 0.6 * rough);
    vec3 half_ = normalize(KEY_DIRECTION + view);
    float nl = max(dot(fine, KEY_DIRECTION), 0.0);
    float nh = max(dot(fine, half_), 0.0);
    float mirror = mix(lobe(rough, nh, nl, nv), lobe(rough * 0.6 + 0.05, nh, nl, nv), 0.25);
    float away = 1.0 - max(dot(view, half_), 0.0);
    float facing = 0.028 + 0.972 * away * away * away * away * away;
    vec3 spark = KEY * 3.14159 * facing * mirror * nl * reach.x;
    vec3 behind = normalize(RIM_DIRECTION + view);
    float bl = max(dot(fine, RIM_DIRECTION), 0.0);
    away = 1.0 - max(dot(view, behind), 0.0);
    facing = 0.028 + 0.972 * away * away * away * away * away;
    spark += RIM * 3.14159 * facing * lobe(rough, max(dot(fine, behind), 0.0), bl, nv) * bl * reach.w;
    float up = 2.0 * dot(fine, view) * fine.y - view.y;
    vec3 around = mix(FLOOR, SKY, clamp(up * 0.5 + 0.5, 0.0, 1.0));
    return albedo * diffuse + spark + around * fresnel * reach.y * reach.y * (1.0 - 0.5 * rough);
}
