#include "harness/cli/cli.h"

int main(int argc, char** argv) { return nullmark::nullmark_main(argc, argv); }
