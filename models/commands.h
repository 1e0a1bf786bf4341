/* The subcommands of psr-model. Each gets argv with its own name in argv[0], reports failures on standard error, and
 * returns the exit status of the program (psr/error.h has the table). */
#ifndef MODELS_COMMANDS_H
#define MODELS_COMMANDS_H

int cmd_build(int argc, char **argv);
int cmd_info(int argc, char **argv);
int cmd_make(int argc, char **argv);
int cmd_accuracy(int argc, char **argv);

#endif
