#pragma once
#include <vector>

// No Eigen and nothing of the library here: plain_step.cpp is compiled for this machine's instruction set and
// must not share inline functions with files that are not.

struct PlainPoint {
    double x[3], v[3], f[3], home[3];
    double m, K, c;
};

struct PlainLink {
    unsigned a, b;
    double k, rest;
};

struct PlainLoad {
    unsigned vertex;
    double f[3];
};

struct PlainBody {
    std::vector<PlainPoint> points;
    std::vector<PlainLink> links;
    std::vector<PlainLoad> loads;
    double gravity[3];
};

void plain_step(PlainBody& body, double dt);
