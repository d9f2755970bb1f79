#version 330 core
// One pixel a vertex of a body: where joints carry it, from the root.
//include gpu_tables.glsl
//include gpu_carry.glsl
uniform sampler2D rest;
uniform isampler2D joints;
uniform sampler2D weights;
uniform sampler2D wring;
uniform int count;
out vec4 place;

void main() {
    int row = int(gl_FragCoord.x) + (int(gl_FragCoord.y) << 10);
    if (row >= count) discard;
    ivec4 by = texelFetch(joints, cell(row), 0);
    vec4 share = texelFetch(weights, cell(row), 0);
    vec3 at = texelFetch(rest, cell(row), 0).xyz;
    place = vec4(carried(at, blended(by, share), by, share, texelFetch(wring, cell(row), 0)), 1.0);
}
