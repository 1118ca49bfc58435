#include "tools/program/program.h"

int main(int argc, char** argv) { return ballot::cli::program(argc, argv); }
