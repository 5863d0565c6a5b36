#version 330
const float BRIGHTEST_ROOT = 1.41421356;  // square root of `lighting.BRIGHTEST`
const float LIGHT_REACH_SQUARE = 12.0;  // metres
uniform sampler2DArray pictures;
uniform sampler2D planes;
uniform vec3 eye;
uniform vec3 lamp;
#if POINT_LIGHTS > 0
uniform vec3 light_places[POINT_LIGHTS];
uniform vec3 light_colours[POINT_LIGHTS];
#endif
#ifdef IN_ATLAS
in vec2 atlas_place;
#else
centroid in vec3 vertex_light;
#endif
in vec3 world;
centroid in vec3 facing;
in vec2 texture_place;
flat in vec4 colour;
flat in vec4 finish;  // layer of the texture, emission, gloss, metalness
out vec4 seen;

vec3 surroundings(vec3 way) {
    vec3 middle = vec3(0.68, 0.66, 0.62);
    return way.z > 0.0 ? mix(middle, vec3(1.0), smoothstep(0.0, 0.9, way.z))
                       : mix(middle, vec3(0.26, 0.24, 0.22), smoothstep(0.0, 0.6, -way.z));
}

// From the square root of light to the picture: bright surfaces keep their form, dark ones are lifted.
vec3 toned(vec3 root) {
    root = min(root * (1.13 - 0.16 * root * root), 1.0);
    vec3 dark = 1.0 - root;
    return root * (1.0 + 0.15 * dark * dark);
}

void main() {
    // Colours and light are stored as square roots.
    vec3 root = colour.rgb * texture(pictures, vec3(texture_place, finish.x)).rgb;
#ifdef IN_ATLAS
    vec3 light_root = texture(planes, atlas_place).rgb * BRIGHTEST_ROOT;
#else
    vec3 light_root = vertex_light * BRIGHTEST_ROOT;
#endif
#if !defined(GLOSSY) && POINT_LIGHTS == 0
    seen = vec4(toned(root * light_root), colour.a);
#else
    vec3 albedo = root * root, light = light_root * light_root;
    vec3 normal = normalize(facing);
#if POINT_LIGHTS > 0
    for (int i = 0; i < POINT_LIGHTS; i++) {
        vec3 way = light_places[i] - world;
        float square = dot(way, way);
        float facing_it = max(dot(normal, way) * inversesqrt(square) * 0.8 + 0.2, 0.0);
        float fading = max(1.0 - square / LIGHT_REACH_SQUARE, 0.0);
        light += light_colours[i] * facing_it * fading * fading / (0.25 + square);
    }
#endif
#ifdef GLOSSY
    vec3 out_to_eye = normalize(eye - world);
    vec3 mirrored = reflect(-out_to_eye, normal);
    float grazing = 1.0 - clamp(dot(out_to_eye, normal), 0.0, 1.0);
    float fresnel = grazing * grazing;
    fresnel *= fresnel;
    float metal = finish.w, gloss = finish.z;
    vec3 reflectance = mix(vec3(0.025), albedo, metal) + (1.0 - mix(0.025, 1.0, metal)) * fresnel * gloss * 0.6;
    float spark = pow(max(dot(mirrored, normalize(lamp - world)), 0.0), mix(8.0, 90.0, gloss)) * gloss * 1.6;
    vec3 shine = reflectance * (surroundings(mirrored) * mix(0.6, 1.3, gloss) + spark) * dot(light, vec3(0.33))
               * mix(gloss, 1.0, metal);
    vec3 sent = albedo * (light * (1.0 - 0.85 * metal) + finish.y) + shine;
    seen = vec4(toned(sqrt(sent)), clamp(colour.a + dot(shine, vec3(0.33)) + 0.5 * fresnel, 0.0, 1.0));
#else
    seen = vec4(toned(sqrt(albedo * light)), colour.a);
#endif
#endif
}
