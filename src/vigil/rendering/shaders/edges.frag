#version 330
// Pixels at an edge between surfaces, mixed with what is on the other side. From one sample a pixel, a slanted edge is a
// row of steps; the line through their middles tells how much of each pixel belongs to which side (Reshetov 2009).
const int STEPS = 8;
const float ALONE = 0.75;  // the share of others where a pixel has edges at all sides
const int LEFT = 1, RIGHT = 2, BELOW = 4, ABOVE = 8;
uniform sampler2D picture;  // its opacity says at which sides a pixel has an edge
out vec4 seen;

int edges(ivec2 pixel) { return int(texelFetch(picture, pixel, 0).a * 255.0 + 0.5); }

// Follows the edges along both sides of a row of pixels. Returns the number of further pixels along each side, and whether
// each edge ends by turning to this row.
vec4 follow(ivec2 pixel, ivec2 way, int here, ivec2 sides, int crossing) {
    ivec2 last = textureSize(picture, 0) - 1;
    bvec2 runs = notEqual(here & sides, ivec2(0));
    vec2 far = vec2(0.0), turns = (here & crossing) != 0 ? vec2(runs) : vec2(0.0);
    if ((here & crossing) != 0)
        runs = bvec2(false);
    for (int i = 1; i <= STEPS; i++) {
        if (!any(runs))
            break;
        int there = edges(clamp(pixel + i * way, ivec2(0), last));
        bvec2 has = notEqual(there & sides, ivec2(0));
        runs = bvec2(runs.x && has.x, runs.y && has.y);
        far += vec2(runs);
        if ((there & crossing) != 0) {
            turns += vec2(runs);
            runs = bvec2(false);
        }
    }
    return vec4(far, turns);
}

// The shares of the pixels on both sides.
vec2 shares(vec4 back, vec4 ahead) {
    vec2 nearest = min(back.xy, ahead.xy), whole = back.xy + ahead.xy + 1.0;
    vec2 is_back = vec2(lessThan(back.xy, ahead.xy)), is_ahead = vec2(lessThan(ahead.xy, back.xy));
    vec2 is_middle = 1.0 - is_back - is_ahead;
    vec2 turns = is_back * back.zw + is_ahead * ahead.zw;
    return turns * (0.5 - (nearest + 0.5) / whole) + is_middle * (back.zw + ahead.zw) / (8.0 * whole);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(picture, 0) - 1;
    vec4 own = texelFetch(picture, pixel, 0);
    int here = int(own.a * 255.0 + 0.5);
    vec2 level = shares(follow(pixel, ivec2(-1, 0), here, ivec2(BELOW, ABOVE), LEFT),
                        follow(pixel, ivec2(1, 0), here, ivec2(BELOW, ABOVE), RIGHT));
    vec2 upright = shares(follow(pixel, ivec2(0, -1), here, ivec2(LEFT, RIGHT), BELOW),
                          follow(pixel, ivec2(0, 1), here, ivec2(LEFT, RIGHT), ABOVE));
    bool is_level = max(level.x, level.y) > max(upright.x, upright.y);
    vec2 share = is_level ? level : upright;
    ivec2 across = is_level ? ivec2(0, 1) : ivec2(1, 0);
    vec3 before = texelFetch(picture, max(pixel - across, 0), 0).rgb;
    vec3 after = texelFetch(picture, min(pixel + across, last), 0).rgb;
    vec3 beside = texelFetch(picture, max(pixel - across.yx, 0), 0).rgb + texelFetch(picture, min(pixel + across.yx, last), 0).rgb;
    vec3 mixed = own.rgb * (1.0 - share.x - share.y) + before * share.x + after * share.y;
    bool is_alone = here == LEFT + RIGHT + BELOW + ABOVE;  // a surface narrower than a pixel
    seen = vec4(is_alone ? mix(own.rgb, 0.25 * (before + after + beside), ALONE) : mixed, 1.0);
}
