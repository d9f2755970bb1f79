#version 330 core
uniform mat4 world;
uniform mat4 camera;
uniform vec3 eye;
uniform float pixel;    // size of a pixel at a distance of 1
uniform float raised;   // lines are drawn over surfaces that hide them by less than this, metres; 0 for meshes
const float LINE = 0.0004;   // radius of the thinnest line
in vec3 in_position;
in vec3 in_normal;
in vec4 in_colour;
out vec3 place;
out vec3 normal;
out vec4 colour;

void main() {
    vec4 at = world * vec4(in_position, 1.0);
    place = at.xyz;
    normal = mat3(world) * in_normal;
    colour = in_colour;
    if (raised > 0.0) {
        // Lines stay visible from afar, and where the skin bulges between their points.
        float away = distance(eye, place);
        place += normal * max(0.55 * pixel * away - LINE, 0.0);
        vec4 nearer = camera * vec4(place + (eye - place) / away * raised, 1.0);
        gl_Position = camera * vec4(place, 1.0);
        gl_Position.z = nearer.z / nearer.w * gl_Position.w;
        return;
    }
    gl_Position = camera * at;
}
