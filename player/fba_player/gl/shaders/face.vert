#version 330 core
// Parts of faces and bodies. Preprocessor options: SMOOTH computes light for each vertex; HAIRS; TEXTURED
// multiplies the colour by a picture; WRINKLED draws wrinkles; FINE adds a relief; LIMBS lets a body's limbs
// keep the sky from each other; FOLDS makes the folds of its clothes grow where they bend; SHADED lets bodies
// throw shadows on each other, FINELY for each pixel; SOLID ignores alpha, CUT makes holes where it is low,
// VEIL blends by it and an opacity. Software OpenGL runs both branches of a
// condition, so each combination of options is a program of its own.
//
// All that is passed on is `centroid`: many triangles of a small face are smaller than a pixel, and values at the
// pixel's middle, well outside them, would be dark or bright specks.
//
// The head turns rigidly; the neck bends with it, and stands still at its lower end.
//include lighting.glsl
#ifdef SHADED
uniform vec3 frame;       // corner of what the map of shadows shows, along its axes, and its share of a metre
uniform float clearance;  // metres by which what throws a shadow is off the surface
#ifdef FINELY
centroid out vec3 before;          // place in that map, and height
#ifdef SMOOTH
centroid out vec3 keyed;           // the key light's part of `shade`
#endif
#endif
#endif
uniform mat4 world;
uniform mat4 camera;
uniform vec3 turn;       // axis of the head's rotation times its angle
uniform vec3 centre;     // the point that it turns about
uniform float pixel;     // size of a pixel at a distance of 1
uniform float scatter;   // how much light scatters below the surface: 1 skin, 0 cloth
uniform float two_sided; // 0: the inside is drawn as a dark hollow
in vec3 in_position;
in vec3 in_normal;
in vec4 in_colour;
in vec2 in_texture;
in vec4 in_light;       // light that reaches the vertex: key light, open sky, through the skin, rim light
in float in_sway;       // how far it turns with the head
#ifdef WRINKLED
in vec2 in_wrinkle;     // place in the map of wrinkles, x positive on the left
uniform vec4 wrinkles_left;  // strength of each wrinkle
uniform vec4 wrinkles_right;
centroid out vec2 wrinkle_place;
centroid out vec4 wrinkles;
#endif
#ifdef LIMBS
uniform vec4 limbs[24]; // both ends of each, and its radius
#endif
#ifdef FOLDS
centroid out float folded;       // how much deeper than in the picture folds are
#endif
#ifdef HAIRS
in vec4 in_across;      // of hairs: from the opposite vertex to this one, and half the width; else 0, 0, 0, 1
in vec4 in_along;       // of hairs: direction to the tip, and which of the two sides this is
#endif
centroid out vec4 upright;       // normal, and its cosine with the direction to the eye
centroid out vec4 coordinates;   // in the picture; share of its pixels that a hair covers; width of reflected light
#ifdef SMOOTH
centroid out vec4 shade;         // diffuse light times the colour, and the reflected share of the key light
centroid out vec4 halfway;       // between the directions to the eye and to the key light; other reflected light
#else
centroid out vec3 place;
centroid out vec4 colour;
centroid out vec4 light;
#endif

const vec3 SKIN = vec3(0.60, 0.36, 0.28);   // typical colour of a texture of skin

vec3 turned(vec3 at, vec3 axis, float sine, float cosine) {
    return at * cosine + cross(axis, at) * sine + axis * (dot(axis, at) * (1.0 - cosine));
}

#ifdef LIMBS
// Share of the sky that comes past limbs: see `fba_player._figure.body_light`.
float past_limbs(vec3 at, vec3 n) {
    float past = 1.0;
    for (int k = 0; k < 24; k += 2) {
        vec3 away = limbs[k].xyz - at, axis = limbs[k + 1].xyz - limbs[k].xyz;
        float radius = limbs[k].w, squared = max(dot(axis, axis), 1e-9);
        // A ball at the nearest point of the axis.
        vec3 ball = away + axis * clamp(-dot(away, axis) / squared, 0.0, 1.0);
        float per = 1.0 / max(dot(ball, ball), 1e-6), towards = dot(n, ball);
        if (towards > 0.0) past *= 1.0 - min(min(radius * radius * per, 1.0) * 1.4 * towards * sqrt(per), 0.9);
    }
    return past;
}
#endif

#ifdef FOLDS
// How much deeper folds are near a joint that is so far away. bend: from the direction of the limb above it
// to that of the limb below. On the inside of the bend they grow; elsewhere cloth is smooth.
float bent(vec3 away, vec3 bend) {
    return max(1.0 - 17.0 * dot(away, away), 0.0) * (20.0 * dot(away, bend) - 0.35);
}

// Limbs have the order of `CAPSULES` in `fba_player._figure.body_light`, and about the lengths of the
// library's figures.
float folds(vec3 at) {
    vec3 trunk = (limbs[0].xyz - limbs[1].xyz) * 2.5;
    vec3 hips = (limbs[16].xyz - limbs[18].xyz) * 5.2, shoulders = (limbs[4].xyz - limbs[6].xyz) * 2.7;
    vec3 waist = at - limbs[0].xyz;
    float leans = 0.5 * dot(shoulders - hips, trunk), turns = 8.0 * length(cross(hips, shoulders));
    float deeper = bent(waist, leans * hips + turns * waist);
    for (int k = 0; k < 4; k += 2) {
        vec3 arm = limbs[k + 4].xyz, hip = limbs[k + 16].xyz, knee = limbs[k + 20].xyz;
        vec3 thigh = (knee - hip) * 2.3;
        deeper += bent(at - arm, (limbs[k + 5].xyz - arm) * 3.5 - trunk) + bent(at - hip, thigh - trunk)
            + bent(at - knee, (limbs[k + 21].xyz - knee) * 2.4 - thigh);
    }
    return clamp(deeper, -0.7, 0.8);
}
#endif

void main() {
    vec3 at = in_position;
    vec4 reach = in_light;
#ifdef LIMBS
    reach.yw *= past_limbs(at, in_normal);
#endif
    vec3 out_ = in_normal;
    float scattered = scatter * min(in_colour.a * 40.0, 1.0); // hair of the scalp has no gloss
    float cover = 1.0;
#ifdef HAIRS
    if (in_across.w < 0.9) {
        // A hair is at least about a pixel wide, however it is turned; it becomes fainter instead.
        vec3 look = eye - (world * vec4(at, 1.0)).xyz;
        float least = 0.6 * pixel * length(look);
        vec3 side = cross(in_along.xyz, transpose(mat3(world)) * look);
        side /= max(length(side), 1e-9);
        float way = dot(side, in_across.xyz);
        at += side * (abs(way) > 0.05 ? sign(way) : in_along.w) * max(least - in_across.w * abs(way), 0.0);
        cover = clamp(in_across.w / least, 0.25, 1.0);
    }
#endif
    float angle = length(turn);
    if (angle > 1e-6) {
        vec3 axis = turn / angle;
        float sine = sin(angle * in_sway);
        float cosine = cos(angle * in_sway);
        at = centre + turned(at - centre, axis, sine, cosine);
        out_ = turned(out_, axis, sine, cosine);
    }
    vec4 stands = world * vec4(at, 1.0);
    vec3 n = normalize(mat3(world) * out_);
    vec3 view = normalize(eye - stands.xyz);
    float facing = dot(n, view);
    if (two_sided > 0.5 && facing < -0.35) {  // between this and 0 it is at a silhouette
        n = -n;
        facing = -facing;
    }
    upright = vec4(n, facing);
    coordinates = vec4(in_texture, cover, widths(in_colour.a));
    gl_Position = camera * stands;
#ifdef SHADED
#ifndef FINELY
    vec3 before;
#endif
    before = vec3(((stands.xyz + clearance * n) * BEFORE - frame.xy) * frame.z, stands.y + clearance * (n.y + 1.0));
#ifndef FINELY
    reach.x *= unshaded(before);
#endif
#endif
#ifdef FOLDS
    folded = folds(at);
#endif
#ifdef WRINKLED
    wrinkle_place = in_wrinkle;
    wrinkles = mix(wrinkles_right, wrinkles_left, smoothstep(-0.1, 0.1, in_wrinkle.x));
#endif
#ifdef SMOOTH
#ifdef TEXTURED
    vec3 albedo = SKIN * in_colour.rgb;
#else
    vec3 albedo = in_colour.rgb;
#endif
    shade.rgb = in_colour.rgb * diffuse(n, albedo, reach, scattered);
#ifdef FINELY
    keyed = shade.rgb - in_colour.rgb * diffuse(n, albedo, vec4(0.0, reach.yzw), scattered);
#endif
    vec2 left = unlost(in_colour.rgb);
    shade.a = mirrored_key(view, n, in_colour.a, reach) * left.x;
    halfway.xyz = normalize(view + KEY_DIRECTION);
    halfway.w = mirrored_around(view, n, in_colour.a, reach) * left.y;
#else
    place = stands.xyz;
    colour = in_colour;
    light = reach;
#endif
}
