#version 330
// The mean of each pixel's samples, darker where its surroundings are less open, and the sky where they are not opaque.
// It is written upside down, because OpenGL reads the lowest row first.
const float DARKEST = 0.42;
uniform sampler2DMS picture;
uniform sampler2D nearness;
uniform samplerCube sky;
uniform mat3 rays;
in vec2 place;
out vec4 seen;

void main() {
    vec2 at = vec2(place.x, 1.0 - place.y);
    ivec2 pixel = ivec2(int(gl_FragCoord.x), textureSize(picture).y - 1 - int(gl_FragCoord.y));
    vec4 mean = 0.25 * (texelFetch(picture, pixel, 0) + texelFetch(picture, pixel, 1)
                      + texelFetch(picture, pixel, 2) + texelFetch(picture, pixel, 3));
    vec3 way = rays * vec3(at * 2.0 - 1.0, 1.0);
    vec3 behind = (1.0 - mean.a) * texture(sky, vec3(way.x, way.z, -way.y)).rgb;
    seen = vec4(mean.rgb * sqrt(mix(DARKEST, 1.0, texture(nearness, at).r)) + behind, 1.0);
}
