#version 330
uniform mat4 view_projection;
uniform sampler2D geoms;
uniform vec4 clip;
in vec3 position;
in vec3 normal;
in vec2 uv;
in int geom;
#ifdef IN_ATLAS
in vec2 place;
out vec2 atlas_place;
#else
// Brightens dim surfaces seen edge on, narrower than a pixel: a dark line would be a row of dots.
const float EDGE_ON = 1.25;
uniform vec3 eye;
in vec3 light;
centroid out vec3 vertex_light;
#endif
out vec3 world;
centroid out vec3 facing;
out vec2 texture_place;
flat out vec4 colour;
flat out vec4 finish;

void main() {
    vec4 x = texelFetch(geoms, ivec2(0, geom), 0);
    vec4 y = texelFetch(geoms, ivec2(1, geom), 0);
    vec4 z = texelFetch(geoms, ivec2(2, geom), 0);
    vec4 local = vec4(position, 1.0);
    world = vec3(dot(x, local), dot(y, local), dot(z, local));
    facing = vec3(dot(x.xyz, normal), dot(y.xyz, normal), dot(z.xyz, normal));
    colour = texelFetch(geoms, ivec2(3, geom), 0);
    finish = texelFetch(geoms, ivec2(4, geom), 0);
    texture_place = uv;
#ifdef IN_ATLAS
    atlas_place = place;
#else
    vertex_light = light;
#endif
    gl_ClipDistance[0] = dot(clip, vec4(world, 1.0));
    gl_Position = view_projection * vec4(world, 1.0);
#ifndef IN_ATLAS
    float aside = abs(dot(facing, normalize(eye - world)));
    float bright = smoothstep(0.35, 0.6, max(max(light.r, light.g), light.b));
    vertex_light *= mix(EDGE_ON, 1.0, max(bright, smoothstep(0.04, 0.16, aside)));
#endif
}
