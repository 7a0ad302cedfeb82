// What a metric file calls float is float64 in its transform and its weight.

#define float double
#define vec2 dvec2
#define vec3 dvec3
#define vec4 dvec4
#define mat2 dmat2
#define mat3 dmat3
#define mat4 dmat4
