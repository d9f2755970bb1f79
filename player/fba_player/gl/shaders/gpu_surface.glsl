// Normals of a body's surface, as fba/body/rings.py has it.
uniform sampler2D moved;     // places of all vertices, from the root

vec3 place(int row) {
    return texelFetch(moved, cell(row), 0).xyz;
}

// around: four neighbours; below 0: the normal as modelled only turns. numbers: what makes a normal of them.
vec3 upright(ivec4 around, vec3 numbers, vec3 modelled, ivec4 joints, vec4 weights) {
    if (around.x < 0) {
        Blend blend = blended(joints, weights);
        return turned(modelled, blend.turn, per(blend.turn));
    }
    vec3 t = place(around.x) - place(around.z);
    vec3 u = place(around.y) - place(around.w);
    vec3 found = numbers.x * t + numbers.y * u + numbers.z * cross(t, u);
    float squared = dot(found, found);
    return squared > 1e-30 ? found * inversesqrt(squared) : found;
}
