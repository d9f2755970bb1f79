#version 330 core
// One pixel a vertex of a face: where FAPs move it, before its part is turned.
//include gpu_tables.glsl
uniform sampler2D rest;
uniform isampler2D spans;     // first entry, and that after the last
uniform isampler2D entries;   // track, its first interval's place in shifts
uniform sampler2D shifts;     // two an interval: where the vertex is at its beginning, the way a step
uniform sampler2D tracks;     // interval or -1, steps into it, whether it begins elsewhere than at rest
uniform int count;
out vec4 place;

void main() {
    int row = int(gl_FragCoord.x) + (int(gl_FragCoord.y) << 10);
    if (row >= count) discard;
    vec3 at = texelFetch(rest, cell(row), 0).xyz;
    ivec2 span = texelFetch(spans, cell(row), 0).xy;
    for (int k = span.x; k < span.y; ++k) {
        ivec2 entry = texelFetch(entries, cell(k), 0).xy;
        vec4 track = texelFetch(tracks, cell(entry.x), 0);
        if (track.x >= 0.0) {
            int interval = entry.y + 2 * int(track.x);
            vec3 shift = track.y * texelFetch(shifts, cell(interval + 1), 0).xyz;
            if (track.z > 0.0) shift += texelFetch(shifts, cell(interval), 0).xyz;
            at += shift;
        }
    }
    place = vec4(at, 1.0);
}
