/* Size, detail, smoothing, passes and codec of pictures. */
#ifndef PSR_CLIENT_SCENE_QUALITY_H
#define PSR_CLIENT_SCENE_QUALITY_H

#include "client/cli/optlist.h"
#include "psr/client.h"

struct quality_wish {
	uint32_t size[2];
	const char *name; /* draft, good, fine, best */
	double spacing;
	int64_t passes;
	int is_smooth, is_plain, has_name, has_spacing, has_passes;
	const char *budget; /* instead of name, spacing, smoothing and passes; NULL: none */
	const char *codec;
	int with_splats;
	int n_said; /* how many of the other options were given */
};

/* name: the quality of who names none. */
void quality_wish_init(struct quality_wish *wish, uint32_t width, uint32_t height, const char *name, const char *codec);
void quality_add_options(struct optlist *list, struct quality_wish *wish);
void quality_add_splats_option(struct optlist *list, struct quality_wish *wish);
void quality_add_codec_option(struct optlist *list, struct quality_wish *wish); /* of still pictures */
void quality_add_budget_option(struct optlist *list, struct quality_wish *wish); /* where each picture stands alone */
int quality_is_said(const struct quality_wish *wish); /* any of these options was given */

/* Sets size, settings or budget, passes and colour codec of the request. ARG, LIMIT. */
int quality_apply(struct psr_msg_frame *frame, const struct quality_wish *wish, struct psr_error *err);

/* With the planes in the request: a fine picture that nobody named is a good one where a server with these
 * capabilities, enum psr_cap, cannot draw it. */
void quality_settle(struct psr_msg_frame *frame, const struct quality_wish *wish, uint64_t capabilities);

#define QUALITY_BUDGET_TEXT 40

/* A budget as --budget takes it: "12ms", "0.5px", "30dB". ARG. */
int quality_parse_budget(struct psr_msg_frame *frame, const char *text, struct psr_error *err);
/* Decibels of an RMSE in codes of sRGB. */
double quality_db(double rmse);
const char *quality_budget_text(char text[QUALITY_BUDGET_TEXT], const struct psr_msg_frame *frame);

/* Chooses how the planes of the request travel, all but colour without loss. */
void quality_choose_codecs(struct psr_msg_frame *frame);

#endif
