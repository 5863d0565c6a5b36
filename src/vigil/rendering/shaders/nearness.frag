#version 330
// How open the surroundings of each point are: 1, or less where something is near and in front of it, most of all where it
// stops light from above, and where something small is between the point and the lamp. Shadows are longer on level
// surfaces than on walls and fronts, where only handles and frames stand out; longer ones would look like smudges.
const int TAPS = 6;
const float REACH = 0.2;  // metres
const float STRENGTH = 1.7;
const int STEPS = 6;
const float SHADE_REACH = 0.8, SHORT_REACH = 0.22;  // metres towards the lamp, from level and from upright surfaces
const float SHADE = 0.5;
const float FLAT = 0.5, LEVEL = 0.9;  // cosines of upright and of level surfaces; below -FLAT are ceilings
const float THIN = 0.03, THICK = 0.12;  // metres by which something stands out from a wall
const float THICKNESS = 0.25;  // metres: surfaces farther in front of a point are not neighbours
uniform sampler2D distances;
uniform vec2 slopes;  // half the width and height of the view at one metre
uniform vec3 upward;  // in the camera's frame: right, up, ahead
uniform vec3 lamp;
in vec2 place;
out vec2 seen;

vec3 at(vec2 p) {
    float z = textureLod(distances, p, 0.0).r;
    return vec3((p * 2.0 - 1.0) * slopes * z, z);
}

// The weight of something that stands out from a point: nearly 0 for frames and boards unless the point's surface is level.
float counted(float lies, float out_m) {
    return mix(smoothstep(THIN, THICK, out_m), 1.0, lies);
}

float nearness(vec3 here, vec3 normal, float turn, float lies) {
    vec2 radius = min(REACH / (here.z * slopes) * 0.5, vec2(0.12));
    float hidden = 0.0, angle = turn * 6.2831853;
    vec2 turned = vec2(cos(angle), sin(angle));
    for (int i = 0; i < TAPS; i++) {
        float tap_angle = float(i) * 0.381966 * 6.2831853;
        vec2 tap = vec2(cos(tap_angle), sin(tap_angle)) * pow((float(i) + 0.5) / float(TAPS), 1.6);
        vec3 way = at(place + vec2(tap.x * turned.x - tap.y * turned.y, tap.x * turned.y + tap.y * turned.x) * radius) - here;
        float square = dot(way, way) + 1e-6;
        float inverse = inversesqrt(square);
        float rising = smoothstep(-0.6, 0.5, dot(way, upward) * inverse);
        float out_m = dot(way, normal);
        hidden += max(out_m * inverse - 0.12, 0.0) * max(1.0 - square * inverse / REACH, 0.0)
                * mix(0.3, 1.0, rising) * counted(lies, out_m);
    }
    return hidden * STRENGTH / float(TAPS);
}

// Follows the way to the lamp as far as the picture shows it.
float shade(vec3 here, vec3 normal, float turn, float lies) {
    vec3 way = normalize(lamp - here);
    float facing = smoothstep(0.0, 0.35, dot(way, normal));
    if (facing <= 0.0 || dot(normal, upward) < -FLAT)  // a lamp's mount does not darken the ceiling
        return 0.0;
    float reach = mix(SHORT_REACH, SHADE_REACH, lies);
    float least = 0.008 + 0.006 * here.z, stopped = 0.0;
    for (int i = 0; i < STEPS; i++) {
        float far = reach * (float(i) + 0.3 + turn) / float(STEPS);
        vec3 point = here + normal * least + way * far;
        float before = point.z - textureLod(distances, point.xy / (point.z * slopes) * 0.5 + 0.5, 0.0).r;
        float is_between = step(least, before) * step(before, THICKNESS);
        stopped = max(stopped, is_between * (1.0 - far / reach) * counted(lies, dot(point - here, normal)));
    }
    return facing * SHADE * smoothstep(0.0, 0.6, stopped);
}

void main() {
    vec3 here = at(place);
    vec2 texel = 1.0 / vec2(textureSize(distances, 0));
    vec3 right = at(place + vec2(texel.x, 0.0)) - here, left = here - at(place - vec2(texel.x, 0.0));
    vec3 above = at(place + vec2(0.0, texel.y)) - here, below = here - at(place - vec2(0.0, texel.y));
    vec3 across = abs(right.z) < abs(left.z) ? right : left;
    vec3 up = abs(above.z) < abs(below.z) ? above : below;
    vec3 normal = normalize(cross(up, across));
    ivec2 pixel = ivec2(gl_FragCoord.xy) & ivec2(3, 1);
    float turn = float((pixel.x * 2 + pixel.y * 5) & 7) / 8.0;
    float lies = smoothstep(FLAT, LEVEL, abs(dot(normal, upward)));
    float open = clamp(1.0 - nearness(here, normal, turn, lies), 0.0, 1.0);
    seen = vec2(open * (1.0 - shade(here, normal, turn, lies)), here.z);
}
