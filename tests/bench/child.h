/* Runs a program and says what it took. */
#ifndef TESTS_BENCH_CHILD_H
#define TESTS_BENCH_CHILD_H

struct child_use {
	double seconds;     /* by the clock */
	double cpu_seconds; /* of all its threads */
	double peak_mib;    /* the most memory that it held at once */
};

/* argv[0] is the program's path, a NULL ends the list; its standard output is dropped. Returns its exit status, or -1
 * if it could not be run or died. */
int child_run(struct child_use *use, const char *const *argv);

#endif
