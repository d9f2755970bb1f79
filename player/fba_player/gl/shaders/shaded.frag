#version 330 core
//include lighting.glsl
// How dark a piece of ground is: from the map of how near the ground is what stands before key light and sky.
// CONTACT: the light there as a share of that in a coarser map, which the ground near feet is drawn with first.
uniform sampler2D heights;      // from above: what share is covered, and nearness to the ground
uniform sampler2D tops;         // along the key light: that share, and height of what it reaches first
uniform vec2 low;               // x and z of the corner of what the map from above shows
uniform float width;            // metres of ground that it shows
uniform vec3 frame;             // corner of what the key light's map shows, along its axes, and its share of a metre
#ifdef CONTACT
uniform sampler2D darkness;     // of all the ground
uniform vec2 corner;            // x and z of the corner of this piece
uniform float size;             // its metres
const float KEY_REACH = 0.16;   // metres: what is further away is softer than the coarser map
const float SOFTEST = 0.02;
const float CELLS = 56.0;
const float TOUCHING = 0.022;   // metres: height of a sole's edge above the ground
#else
const float KEY_REACH = 0.45;   // metres
const float SOFTEST = 0.06;
const float CELLS = 64.0;
#endif
out vec4 pixel;

const int TAPS = 12;
const float KEY_SHARE = 0.62;   // darkness where all of the key light is hidden
const float SKY_SHARE = 0.85;   // and where all of the sky is
const float SPREAD = 0.26;      // width of the key light's soft edge for each metre above the ground
const float SKY_REACH = 1.0;
const float LEAST_HEIGHT = 0.06;

// Places over a disc, in a spiral.
vec2 spiral(int k, float power) {
    return pow((float(k) + 0.5) / float(TAPS), power) * vec2(cos(2.39996 * float(k)), sin(2.39996 * float(k)));
}

// The map from above around a place on the ground, over a piece of this many square metres.
vec2 above(vec2 ground, float area) {
    float texels = float(textureSize(heights, 0).x) / width;
    return textureLod(heights, (ground - low) / width, 0.5 * log2(area) + log2(texels)).rg;
}

// Share of the key light that is hidden there, and this times the height of what hides it.
vec2 along_key(vec2 ground, float area) {
    float texels = float(textureSize(tops, 0).x) * frame.z;
    vec2 at = (vec3(ground.x, 0.0, ground.y) * BEFORE - frame.xy) * frame.z;
    vec2 beyond = (abs(at - 0.5) - 0.5) / frame.z;  // metres; the map's edge is repeated for ever
    float within = clamp(1.0 - 4.0 * max(beyond.x, beyond.y), 0.0, 1.0);
    return within * textureLod(tops, at, 0.5 * log2(area * KEY_DIRECTION.y) + log2(texels)).rg;
}

float height(vec2 seen) {
    return max((1.0 - seen.y / max(seen.x, 1e-4)) * HIGHEST, LEAST_HEIGHT);
}

void main() {
    vec2 here = gl_FragCoord.xy / CELLS;
#ifdef CONTACT
    vec2 ground = corner + here * size;
#else
    vec2 ground = low + here * width;
#endif
    float sky = 0.0, hidden = 0.0, high = 0.0, key = 0.0;
    for (int k = 0; k < TAPS; ++k) {
        // The sky: each piece of ground below a surface takes its share of the hemisphere. Denser near by.
        float along = (float(k) + 0.5) / float(TAPS);
        float area = 4.0 * SKY_REACH * SKY_REACH * along * along * along / float(TAPS);  // over pi
        vec2 seen = above(ground + spiral(k, 2.0) * SKY_REACH, 3.14 * area);
        float rise = height(seen);
        float away = SKY_REACH * SKY_REACH * along * along * along * along;
        float apart = rise * rise + away;
        float hides = rise * rise / (apart * apart);
#ifdef CONTACT
        rise = max((1.0 - seen.y / max(seen.x, 1e-4)) * HIGHEST, TOUCHING);
        apart = rise * rise + away;
        // The dark line along a sole belongs to what touches the ground: a raised toe has none.
        float touches = min(4.0 * TOUCHING * TOUCHING / (rise * rise), 1.0);
        hides = 0.7 * hides + 1.1 * touches * touches * rise * rise / (apart * apart);
#endif
        sky += seen.x * area * hides;
        vec2 before = along_key(ground + spiral(k, 0.5) * KEY_REACH, 0.2 * KEY_REACH * KEY_REACH);
        hidden += before.x;
        high += before.y;
    }
    float soft = clamp(SPREAD * high / max(hidden, 1e-4), SOFTEST, KEY_REACH);
    for (int k = 0; k < TAPS; ++k) {
        key += along_key(ground + spiral(k, 0.5) * soft, 3.14 * soft * soft / float(TAPS)).r;
    }
    vec2 edge = min(here, 1.0 - here) * CELLS / 8.0;
    float lit = (1.0 - KEY_SHARE * key / float(TAPS)) * (1.0 - SKY_SHARE * min(sky, 1.0));
    float inside = clamp(min(edge.x, edge.y), 0.0, 1.0);
#ifdef CONTACT
    pixel = vec4(0.5 * mix(1.0, lit / (1.0 - texture(darkness, (ground - low) / width).r), inside));
#else
    pixel = vec4((1.0 - lit) * inside);
#endif
}
