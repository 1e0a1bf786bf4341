/* The subcommands of psr. Each takes argv[0] = its own name and returns the exit status. */
#ifndef PSR_CLIENT_COMMANDS_H
#define PSR_CLIENT_COMMANDS_H

int psr_list_main(int argc, char **argv);
int psr_shot_main(int argc, char **argv);
int psr_turntable_main(int argc, char **argv);
int psr_view_main(int argc, char **argv);
int psr_test_main(int argc, char **argv);
int psr_bench_main(int argc, char **argv);
int psr_stats_main(int argc, char **argv);
int psr_fetch_main(int argc, char **argv);

#endif
