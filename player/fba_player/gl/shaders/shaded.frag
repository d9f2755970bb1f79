#version 330 core
//include lighting.glsl
// How dark the ground is: from the map of how near the ground is what stands before key light and sky.
uniform sampler2D heights;      // from above: what share is covered, and nearness to the ground
uniform sampler2D tops;         // along the key light: that share, and height of what it reaches first
uniform vec2 low;               // x and z of the corner of the ground
uniform float width;            // metres of ground
uniform vec3 frame;             // corner of what the key light's map shows, along its axes, and its share of a metre
out vec4 pixel;

const float CELLS = 64.0;
const float KEY_SHARE = 0.62;   // darkness where all of the key light is hidden
const float SKY_SHARE = 0.85;   // and where all of the sky is
const float SPREAD = 0.30;      // width of the key light's soft edge for each metre above the ground
const float KEY_REACH = 0.45;   // metres
const float SKY_REACH = 1.0;
const float LEAST_HEIGHT = 0.06;
const int TAPS = 12;

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
    return textureLod(tops, at, 0.5 * log2(area * KEY_DIRECTION.y) + log2(texels)).rg;
}

float height(vec2 seen) {
    return max((1.0 - seen.y / max(seen.x, 1e-4)) * HIGHEST, LEAST_HEIGHT);
}

void main() {
    vec2 here = gl_FragCoord.xy / CELLS, ground = low + here * width;
    float sky = 0.0, hidden = 0.0, high = 0.0, key = 0.0;
    for (int k = 0; k < TAPS; ++k) {
        // The sky: each piece of ground below a surface takes its share of the hemisphere. Denser near by.
        float along = (float(k) + 0.5) / float(TAPS);
        float area = 4.0 * SKY_REACH * SKY_REACH * along * along * along / float(TAPS);  // over pi
        vec2 seen = above(ground + spiral(k, 2.0) * SKY_REACH, 3.14 * area);
        float rise = height(seen);
        float apart = rise * rise + SKY_REACH * SKY_REACH * along * along * along * along;
        sky += seen.x * area * rise * rise / (apart * apart);
        vec2 before = along_key(ground + spiral(k, 0.5) * KEY_REACH, 0.2 * KEY_REACH * KEY_REACH);
        hidden += before.x;
        high += before.y;
    }
    float soft = clamp(SPREAD * max(high / max(hidden, 1e-4), LEAST_HEIGHT), 0.06, KEY_REACH);
    for (int k = 0; k < TAPS; ++k) {
        key += along_key(ground + spiral(k, 0.5) * soft, 3.14 * soft * soft / float(TAPS)).r;
    }
    vec2 edge = min(here, 1.0 - here) * CELLS / 8.0;
    float lit = (1.0 - KEY_SHARE * key / float(TAPS)) * (1.0 - SKY_SHARE * min(sky, 1.0));
    pixel = vec4((1.0 - lit) * clamp(min(edge.x, edge.y), 0.0, 1.0));
}
