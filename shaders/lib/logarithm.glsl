// ln(1 + x) for x > -1, with all digits also near zero (Goldberg 1991, "What every computer scientist
// should know about floating-point arithmetic", theorem 4).
float log_one_plus(float x) {
    precise float sum = 1.0 + x;
    precise float added = sum - 1.0;
    return added != 0.0 ? log(sum) * (x / added) : x;
}

vec3 log_one_plus(vec3 x) { return vec3(log_one_plus(x.x), log_one_plus(x.y), log_one_plus(x.z)); }
