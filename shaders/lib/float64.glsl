// The functions of GLSL that it has for float only, for double: a transform or a weight calls them by
// their usual names. Relative errors are below 2e-15 (tests/engine/metric/float64_test.cpp) unless said
// otherwise. In C++ the standard library has them all, so there this file is not compiled.
//
// The polynomials are those of FDLIBM (Sun Microsystems 1993). Results below 2^-1022 are 0 or
// subnormal.

const double kPiHalf = 1.57079632679489661923lf;
const double kLn2 = 0.69314718055994530942lf;

double infinity64() { return packDouble2x32(uvec2(0u, 0x7ff00000u)); }
double nan64() { return packDouble2x32(uvec2(0u, 0x7ff80000u)); }

// 2^k for -1022 <= k <= 1023.
double power_of_two64(int k) { return packDouble2x32(uvec2(0u, uint(k + 1023) << 20)); }

// x = 2^k m with m in [sqrt(1/2), sqrt(2)), for a finite x > 0.
double split_exponent64(double x, out int k) {
    k = 0;
    if (x < 2.3e-308lf) {  // subnormal
        x *= 18014398509481984.0lf;
        k = -54;
    }
    uvec2 bits = unpackDouble2x32(x);
    uint high = bits.y & 0xfffffu;
    uint up = (high + 0x95f64u) & 0x100000u;  // 1 in bit 20 when m would be above sqrt(2)
    k += int(bits.y >> 20) - 1023 + int(up >> 20);
    return packDouble2x32(uvec2(bits.x, high | (up ^ 0x3ff00000u)));
}

// ln m for m in [sqrt(1/2), sqrt(2)).
double log_near_one64(double m) {
    double f = m - 1.0lf;
    double s = f / (2.0lf + f);
    double z = s * s;
    double r = z * (0.6666666666666735130lf + z * (0.3999999999940941908lf +
               z * (0.2857142874366239149lf + z * (0.2222219843214978396lf +
               z * (0.1818357216161805012lf + z * (0.1531383769920937332lf +
               z * 0.1479819860511658591lf))))));
    double half_square = 0.5lf * f * f;
    return f - (half_square - s * (half_square + r));
}

double log(double x) {
    if (!(x > 0.0lf) || x == infinity64()) {
        return x == 0.0lf ? -infinity64() : x > 0.0lf ? x : nan64();
    }
    int k;
    double m = split_exponent64(x, k);
    double n = double(k);
    return n * 6.93147180369123816490e-01lf + (n * 1.90821492927058770002e-10lf + log_near_one64(m));
}

double log2(double x) {
    if (!(x > 0.0lf) || x == infinity64()) {
        return x == 0.0lf ? -infinity64() : x > 0.0lf ? x : nan64();
    }
    int k;
    double m = split_exponent64(x, k);
    return double(k) + log_near_one64(m) * 1.44269504088896340736lf;
}

// e^r 2^k for |r| <= 1.5 and any k.
double scaled_exp64(double r, int k) {
    int more = int(roundEven(r * 1.44269504088896340736lf));
    double n = double(more);
    double high = r - n * 6.93147180369123816490e-01lf;
    double low = n * 1.90821492927058770002e-10lf;
    double x = high - low;
    double t = x * x;
    double c = x - t * (1.66666666666666019037e-01lf + t * (-2.77777777770155933842e-03lf +
                   t * (6.61375632143793436117e-05lf + t * (-1.65339022054652515390e-06lf +
                   t * 4.13813679705723846039e-08lf))));
    double y = 1.0lf - ((low - (x * c) / (2.0lf - c)) - high);
    k += more;
    if (k > 1023) {  // by its exponent, because 2^1024 on its own is infinite
        uvec2 bits = unpackDouble2x32(y * power_of_two64(1023));
        return k > 1024 || y >= 1.0lf ? infinity64() : packDouble2x32(bits + uvec2(0u, 0x100000u));
    }
    return k < -1022 ? 0.0lf : y * power_of_two64(k);
}

double exp(double x) {
    if (!(x < 710.0lf)) {
        return x > 0.0lf ? infinity64() : nan64();
    }
    if (x < -710.0lf) {
        return 0.0lf;
    }
    double n = roundEven(x * 1.44269504088896340736lf);
    // The first product is exact: its factor has 32 bits.
    return scaled_exp64((x - n * 6.93147180369123816490e-01lf) - n * 1.90821492927058770002e-10lf, int(n));
}

double exp2(double x) {
    if (!(x < 1024.0lf)) {
        return x > 0.0lf ? infinity64() : nan64();
    }
    if (x < -1024.0lf) {
        return 0.0lf;
    }
    double n = roundEven(x);
    return scaled_exp64((x - n) * kLn2, int(n));
}

// x^y for x > 0 (and 0 for x = 0 and y > 0). The relative error is below (3 + |y|) 4e-16.
double pow(double x, double y) {
    if (x == 0.0lf && y > 0.0lf) {
        return 0.0lf;
    }
    if (!(x > 0.0lf) || x == infinity64() || !(abs(y) < 1e6lf)) {
        return nan64();
    }
    int k;
    double m = split_exponent64(x, k);
    double rest = y * log_near_one64(m);
    // k y in two parts, each exact: the first has 32 bits of y.
    uvec2 bits = unpackDouble2x32(y);
    double y_high = packDouble2x32(uvec2(0u, bits.y));
    double whole = double(k) * y_high;
    double n = roundEven(whole + rest * 1.44269504088896340736lf);
    if (abs(n) > 1100.0lf) {
        return n > 0.0lf ? infinity64() : 0.0lf;
    }
    double fraction = (whole - n) + double(k) * (y - y_high);
    // rest and fraction ln 2 nearly cancel where both are large; their sum is at most ln 2 / 2.
    return scaled_exp64(fraction * kLn2 + rest, int(n));
}

// The argument less the multiple n of pi/2 that is nearest, for |x| <= 1e5; NaN beyond, where digits are lost.
double less_quarter_turns64(double x, out int n) {
    n = 0;
    if (!(abs(x) <= 1e5lf)) {
        return nan64();
    }
    double turns = roundEven(x * 0.63661977236758134308lf);
    n = int(turns);
    return ((x - turns * 1.57079632673412561417e+00lf) - turns * 6.07710050630396597660e-11lf) -
           turns * 2.02226624879595063154e-21lf;
}

double sin_near_zero64(double x) {
    double z = x * x;
    return x + x * z * (-1.66666666666666324348e-01lf + z * (8.33333333332248946124e-03lf +
                   z * (-1.98412698298579493134e-04lf + z * (2.75573137070700676789e-06lf +
                   z * (-2.50507602534068634195e-08lf + z * 1.58969099521155010221e-10lf)))));
}

double cos_near_zero64(double x) {
    double z = x * x;
    double r = z * (4.16666666666666019037e-02lf + z * (-1.38888888888741095749e-03lf +
               z * (2.48015872894767294178e-05lf + z * (-2.75573143513906633035e-07lf +
               z * (2.08757232129817482790e-09lf - z * 1.13596475577881948265e-11lf)))));
    double half_square = 0.5lf * z;
    double w = 1.0lf - half_square;
    return w + (((1.0lf - w) - half_square) + z * r);
}

// sin, cos and tan: absolute error below 1e-15 (of tan: relative to 1 + tan^2) for |x| <= 1e5; else NaN.
double sin(double x) {
    int n;
    double r = less_quarter_turns64(x, n);
    double y = (n & 1) == 0 ? sin_near_zero64(r) : cos_near_zero64(r);
    return (n & 2) == 0 ? y : -y;
}

double cos(double x) {
    int n;
    double r = less_quarter_turns64(x, n);
    double y = (n & 1) == 0 ? cos_near_zero64(r) : sin_near_zero64(r);
    return ((n + 1) & 2) == 0 ? y : -y;
}

double tan(double x) { return sin(x) / cos(x); }

double atan(double x) {
    double a = abs(x);
    double from = 0.0lf;  // atan(a) = from + atan(t)
    double t = a;
    if (a >= 2.4375lf) {
        from = kPiHalf;
        t = -1.0lf / a;
    } else if (a >= 1.1875lf) {
        from = 0.98279372324732906799lf;
        t = (a - 1.5lf) / (1.0lf + 1.5lf * a);
    } else if (a >= 0.6875lf) {
        from = 0.78539816339744830962lf;
        t = (a - 1.0lf) / (a + 1.0lf);
    } else if (a >= 0.4375lf) {
        from = 0.46364760900080611621lf;
        t = (2.0lf * a - 1.0lf) / (2.0lf + a);
    }
    double z = t * t;
    double r = z * (3.33333333333329318027e-01lf + z * (-1.99999999998764832476e-01lf +
               z * (1.42857142725034663711e-01lf + z * (-1.11111104054623557880e-01lf +
               z * (9.09088713343650656196e-02lf + z * (-7.69187620504482999495e-02lf +
               z * (6.66107313738753120669e-02lf + z * (-5.83357013379057348645e-02lf +
               z * (4.97687799461593236017e-02lf + z * (-3.65315727442169155270e-02lf +
               z * 1.62858201153657823623e-02lf))))))))));
    double y = from + (t - t * r);
    return x < 0.0lf ? -y : y;
}

// The angle of the point (x, y), from -pi to pi; 0 for (0, 0).
double atan(double y, double x) {
    if (abs(x) >= abs(y)) {
        double turn = y < 0.0lf ? -2.0lf * kPiHalf : 2.0lf * kPiHalf;
        return x == 0.0lf ? 0.0lf : x > 0.0lf ? atan(y / x) : atan(y / x) + turn;
    }
    return (y < 0.0lf ? -kPiHalf : kPiHalf) - atan(x / y);
}

double asin(double x) { return atan(x, sqrt((1.0lf - x) * (1.0lf + x))); }
double acos(double x) { return atan(sqrt((1.0lf - x) * (1.0lf + x)), x); }

#define EACH64(f)                                                \
    dvec2 f(dvec2 v) { return dvec2(f(v.x), f(v.y)); }           \
    dvec3 f(dvec3 v) { return dvec3(f(v.x), f(v.y), f(v.z)); }   \
    dvec4 f(dvec4 v) { return dvec4(f(v.xyz), f(v.w)); }
EACH64(log)
EACH64(log2)
EACH64(exp)
EACH64(exp2)
EACH64(sin)
EACH64(cos)
EACH64(tan)
EACH64(atan)
EACH64(asin)
EACH64(acos)
#undef EACH64

dvec3 pow(dvec3 x, dvec3 y) { return dvec3(pow(x.x, y.x), pow(x.y, y.y), pow(x.z, y.z)); }
