#version 330 core
// One pixel for each vertex at which light is worked out: what comes past a body's limbs, as
// player/body_light.py has it.
//include gpu_tables.glsl
//include gpu_carry.glsl
//include gpu_surface.glsl
uniform isampler2D at;         // the vertex
uniform isampler2D around;
uniform sampler2D numbers;
uniform sampler2D modelled;
uniform isampler2D joints;
uniform sampler2D weights;
uniform sampler2D capsules;    // three each: an end, radius; way to the other, 1 / its square; towards the key
uniform int limbs;             // light, 1 / square of what is left of the way, square of the radius
uniform vec3 key;
uniform vec3 root;
uniform int count;
out vec4 past;

void main() {
    int row = int(gl_FragCoord.x) + (int(gl_FragCoord.y) << 10);
    if (row >= count) discard;
    vec3 n = upright(texelFetch(around, cell(row), 0), texelFetch(numbers, cell(row), 0).xyz,
        texelFetch(modelled, cell(row), 0).xyz, texelFetch(joints, cell(row), 0), texelFetch(weights, cell(row), 0));
    vec3 stands = place(texelFetch(at, cell(row), 0).x) + root;
    bool towards_key = dot(n, key) >= -0.2;
    float lit = 1.0;
    float sky = 1.0;
    for (int k = 0; k < limbs; ++k) {
        vec4 end = texelFetch(capsules, cell(3 * k), 0);
        vec4 way = texelFetch(capsules, cell(3 * k + 1), 0);
        vec4 rest = texelFetch(capsules, cell(3 * k + 2), 0);
        vec3 a = end.xyz - stands;
        float ab = dot(a, way.xyz);
        // The sky: the nearest place of the axis, as a ball there.
        vec3 d = a + clamp(-ab * way.w, 0.0, 1.0) * way.xyz;
        float towards = dot(n, d);
        if (towards > 0.0) {
            float per_square = 1.0 / max(dot(d, d), 1e-6);
            float share = min(rest.z * per_square, 1.0) * 1.4;
            sky *= 1.0 - min(share * towards * sqrt(per_square), 0.9);
        }
        // The key light: where the way to it comes nearest to the axis.
        float radius = end.w;
        float ak = dot(a, key);
        float s = clamp((ak * rest.x - ab) * rest.y, 0.0, 1.0);
        float ahead = ak + s * rest.x;
        if (towards_key && ahead > 0.4 * radius) {
            d = a + s * way.xyz - ahead * key;
            float soft = 0.12 * ahead + 0.012;
            float away = length(d);
            if (away < radius + soft) {
                float hidden = min((radius + soft - away) / (2.0 * soft), 1.0);
                hidden = hidden * hidden * (3.0 - 2.0 * hidden);
                // a limb does not hide its own skin
                lit *= 1.0 - hidden * min((ahead / radius - 0.4) / 1.2, 1.0);
            }
        }
    }
    past = vec4(lit, sky, 0.0, 1.0);
}
