/* What a load asks for: kinds of requests by weight, from the command line or from a file (psr-mix(5)). */
#ifndef PSR_CLIENT_BENCH_MIX_H
#define PSR_CLIENT_BENCH_MIX_H

#include "client/scene/quality.h"
#include "client/scene/view.h"

#define MIX_MAX PSR_WIRE_MAX_SCENES /* each line has a scene of its own on each connection */

struct mix_line {
	struct scene_wish scene;
	struct view_wish view;
	struct quality_wish quality;
	const char *path; /* flight.h */
	double weight;
	struct psr_msg_frame frame; /* all fields but the camera */
};

struct mix {
	struct mix_line line[MIX_MAX];
	uint32_t n;
	char *text; /* holds the strings of the lines */
};

/* Fills in defaults. */
void mix_line_init(struct mix_line *line);

/* Lists all options of a line but its weight. They point into *line. */
void mix_add_options(struct optlist *list, struct mix_line *line);

/* Makes a mix of this line alone, or of the file if it is not NULL: then `said` gives camera and quality where a line
 * has none, and models or lights in it are an error. Takes over the memory of said->scene. mix_fini() is due also after
 * an error. ARG, LIMIT, and the errors of wordfile_read(), with line and column. */
int mix_make(struct mix *mix, struct mix_line *said, const char *file, struct psr_error *err);
void mix_fini(struct mix *mix);

#endif
