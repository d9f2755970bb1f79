#version 330 core
//include lighting.glsl
// How dark the ground is: from the map of how near the ground is what stands before key light and sky.
uniform sampler2D heights;      // along the key light, then from above: nearness, and what share is covered
uniform float width;            // metres of ground
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

// The map around a place, over a piece of this many square metres.
vec4 around(vec2 at, float area) {
    return textureLod(heights, at, 0.5 * log2(area) - log2(width / float(textureSize(heights, 0).x)));
}

float height(vec2 seen) {
    return max((1.0 - seen.x / max(seen.y, 1e-4)) * HIGHEST, LEAST_HEIGHT);
}

void main() {
    vec2 here = gl_FragCoord.xy / CELLS;
    float sky = 0.0, hidden = 0.0, high = 0.0, key = 0.0;
    for (int k = 0; k < TAPS; ++k) {
        // The sky: each piece of ground below a surface takes its share of the hemisphere. Denser near by.
        float along = (float(k) + 0.5) / float(TAPS);
        float area = 4.0 * SKY_REACH * SKY_REACH * along * along * along / float(TAPS);  // over pi
        vec2 above = around(here + spiral(k, 2.0) * SKY_REACH / width, 3.14 * area).ba;
        float rise = height(above);
        float apart = rise * rise + SKY_REACH * SKY_REACH * along * along * along * along;
        sky += above.y * area * rise * rise / (apart * apart);
        vec2 before = around(here + spiral(k, 0.5) * KEY_REACH / width, 0.2 * KEY_REACH * KEY_REACH).rg;
        hidden += before.y;
        high += before.y * height(before);
    }
    float soft = clamp(SPREAD * high / max(hidden, 1e-4), 0.06, KEY_REACH);
    for (int k = 0; k < TAPS; ++k) {
        key += around(here + spiral(k, 0.5) * soft / width, 3.14 * soft * soft / float(TAPS)).g;
    }
    vec2 edge = min(here, 1.0 - here) * CELLS / 8.0;
    float lit = (1.0 - KEY_SHARE * key / float(TAPS)) * (1.0 - SKY_SHARE * min(sky, 1.0));
    pixel = vec4((1.0 - lit) * clamp(min(edge.x, edge.y), 0.0, 1.0));
}
