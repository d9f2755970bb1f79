#version 330 core
// Some vertices of a face: their parts' turns, and normals from the triangles around. CARRIED: on a body. LIT:
// and the light that reaches them.
//include gpu_tables.glsl
#ifdef CARRIED
//include gpu_carry.glsl
uniform float size;          // the face put on the body as modelled
uniform vec3 offset;
uniform vec3 root;           // where the body's root is
in ivec4 in_joints;
in vec4 in_weights;
in vec4 in_wring;
#endif
uniform sampler2D moved;     // places of all vertices
uniform isampler2D triangles;
uniform sampler2D parts;     // six a part: rows of its pose, and of how it turns normals
in int in_row;
in int in_part;
in ivec2 in_around;          // first and after the last of its triangles; none where its normal is kept
in vec3 in_neutral;
out vec3 position;
out vec3 normal;
#ifdef LIT
//include gpu_face_light.glsl
in int in_near;
in float in_sway;
out vec4 light;
#endif

vec3 place(int row) {
    return texelFetch(moved, cell(row), 0).xyz;
}

void main() {
    vec3 sum = vec3(0.0);
    for (int k = in_around.x; k < in_around.y; ++k) {
        ivec3 corners = texelFetch(triangles, cell(k), 0).xyz;
        vec3 a = place(corners.x);
        sum += cross(place(corners.y) - a, place(corners.z) - a);
    }
    float squared = dot(sum, sum);
    if (!(squared > 1e-30 && squared < 1e30)) sum = in_neutral;
    int part = 6 * in_part;
    vec4 at = vec4(place(in_row), 1.0);
    position = vec3(dot(texelFetch(parts, cell(part), 0), at), dot(texelFetch(parts, cell(part + 1), 0), at),
        dot(texelFetch(parts, cell(part + 2), 0), at));
    normal = vec3(dot(texelFetch(parts, cell(part + 3), 0).xyz, sum),
        dot(texelFetch(parts, cell(part + 4), 0).xyz, sum), dot(texelFetch(parts, cell(part + 5), 0).xyz, sum));
    float length_ = length(normal);
    normal *= length_ > 0.0 ? 1.0 / length_ : 1.0;
#ifdef LIT
    light = light_on_face(in_row, in_near, in_sway);
#endif
#ifdef CARRIED
    Blend blend = blended(in_joints, in_weights);
    position = carried(size * position + offset, blend, in_joints, in_weights, in_wring) + root;
    normal = turned(normal, blend.turn, per(blend.turn));
#endif
}
