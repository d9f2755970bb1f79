#version 330 core
// One instance per capsule: a rounded cone with an elliptic section between two ends.
uniform mat4 camera;
uniform vec3 eye;
uniform float pixel;      // size of a pixel at a distance of 1
uniform float raised;     // drawn over surfaces that hide it by less than this, metres
uniform float thinnest;   // least radius, pixels
in vec3 in_sphere;   // on the unit sphere, y along the axis
in float in_end;     // 0 at the start, 1 at the end
in vec4 in_start;    // position and radius
in vec4 in_finish;
in vec4 in_front;    // direction of the section's depth, and depth / width
in vec4 in_colour;
out vec3 place;
out vec3 normal;
out vec4 colour;

void main() {
    vec3 axis = in_finish.xyz - in_start.xyz;
    float length_ = max(length(axis), 1e-6);
    axis /= length_;
    vec3 front = in_front.xyz - axis * dot(axis, in_front.xyz);
    front = normalize(dot(front, front) < 1e-4 ? vec3(axis.y, axis.z, axis.x) : front);
    vec3 side = cross(axis, front);
    float radius = mix(in_start.w, in_finish.w, in_end);
    radius = max(radius, thinnest * pixel * distance(eye, in_start.xyz));
    float cap = radius * mix(1.0, min(in_front.w, 1.0), 0.35);
    // The cone's slope tilts the circle where cap and side meet.
    float slope = clamp((in_start.w - in_finish.w) / length_, -0.9, 0.9);
    vec3 on = in_sphere;
    vec3 centre = mix(in_start.xyz, in_finish.xyz, in_end);
    place = centre + side * on.x * radius + front * on.z * radius * in_front.w + axis * (on.y * cap);
    float flat_ = length(on.xz);
    normal = normalize(side * on.x + front * on.z / in_front.w + axis * (on.y * radius / cap + slope * flat_));
    colour = in_colour;
    gl_Position = camera * vec4(place, 1.0);
    if (raised > 0.0) {
        vec4 nearer = camera * vec4(place + normalize(eye - place) * raised, 1.0);
        gl_Position.z = nearer.z / nearer.w * gl_Position.w;
    }
}
