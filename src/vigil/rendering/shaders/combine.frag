#version 330
// The mean of each pixel's samples, darker where its surroundings are less open.
const float DARKEST = 0.42;
uniform sampler2DMS picture;
uniform sampler2D nearness;
uniform sampler2DMS depth;
uniform vec2 planes;
out vec4 seen;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float far = planes.x * planes.y / (planes.y - texelFetch(depth, pixel, 0).r * (planes.y - planes.x));
    // The four nearest pixels at half the size, of which one is three times as near along each axis as the other.
    ivec2 near = pixel / 2, next = clamp(near + 2 * (pixel & 1) - 1, ivec2(0), textureSize(nearness, 0) - 1);
    vec4 open, away;
    vec2 there = texelFetch(nearness, near, 0).rg;
    open.x = there.r, away.x = there.g;
    there = texelFetch(nearness, ivec2(next.x, near.y), 0).rg;
    open.y = there.r, away.y = there.g;
    there = texelFetch(nearness, ivec2(near.x, next.y), 0).rg;
    open.z = there.r, away.z = there.g;
    there = texelFetch(nearness, next, 0).rg;
    open.w = there.r, away.w = there.g;
    vec4 share = vec4(9.0, 3.0, 3.0, 1.0) / 16.0 * max(vec4(0.001), 1.0 - abs(away - far) * (20.0 / far)) + 1e-6;
    vec3 mean = 0.25 * (texelFetch(picture, pixel, 0).rgb + texelFetch(picture, pixel, 1).rgb
                      + texelFetch(picture, pixel, 2).rgb + texelFetch(picture, pixel, 3).rgb);
    seen = vec4(mean * sqrt(mix(DARKEST, 1.0, dot(share, open) / dot(share, vec4(1.0)))), 1.0);
}
