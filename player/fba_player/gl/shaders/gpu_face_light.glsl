// Light on a face, as player/face_light_loops.py has it.
uniform sampler2D visible;   // nine a vertex: harmonics of what it sees, of what comes through it, the open sky
uniform sampler2D wide;      // the same near a mouth that is wide open
uniform vec4 key[4];         // what weighs the harmonics for the key light and for the rim light
uniform vec4 rim[4];
uniform vec4 still_key[4];   // the same for what does not go with the head
uniform vec4 still_rim[4];
uniform float share;         // how far the mouth is wide open
uniform float more;          // what share of the light that is missing falls in

vec4 reaching(sampler2D seen, int row, vec4 towards_key[4], vec4 towards_rim[4]) {
    vec3 found = vec3(0.0);  // key, rim, through
    for (int k = 0; k < 4; ++k) {
        vec4 light = texelFetch(seen, cell(9 * row + k), 0);
        found.x += dot(towards_key[k], light);
        found.y += dot(towards_rim[k], light);
        found.z += dot(towards_rim[k], texelFetch(seen, cell(9 * row + 4 + k), 0));
    }
    found = clamp(found, 0.0, 1.0);
    return vec4(found.x, texelFetch(seen, cell(9 * row + 8), 0).x, found.z, found.y);
}

vec4 with_mouth(int row, int near, vec4 towards_key[4], vec4 towards_rim[4]) {
    vec4 found = reaching(visible, row, towards_key, towards_rim);
    if (near >= 0 && share > 0.0) found += share * (reaching(wide, near, towards_key, towards_rim) - found);
    found.xy += more * (1.0 - found.xy);
    return found;
}

// near: the vertex among those near the mouth, or -1; sway: how far it goes with the head.
vec4 light_on_face(int row, int near, float sway) {
    vec4 found = with_mouth(row, near, key, rim);
    if (sway < 1.0) found = mix(with_mouth(row, near, still_key, still_rim), found, sway);
    return found;
}
