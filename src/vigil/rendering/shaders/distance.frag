#version 330
// The distance of each pixel at half the size: the nearest of four pixels.
uniform sampler2DMS depth;
uniform vec2 planes;  // near, far
out float seen;

void main() {
    ivec2 first = 2 * ivec2(gl_FragCoord.xy);
    ivec2 last = min(first + 1, textureSize(depth) - 1);
    float d = min(min(texelFetch(depth, first, 0).r, texelFetch(depth, last, 0).r),
                  min(texelFetch(depth, ivec2(first.x, last.y), 0).r, texelFetch(depth, ivec2(last.x, first.y), 0).r));
    seen = planes.x * planes.y / (planes.y - d * (planes.y - planes.x));
}
