/* What shot and turntable share: one scene, any number of cameras, and where the pictures go. */
#ifndef PSR_CLIENT_DRAW_H
#define PSR_CLIENT_DRAW_H

#include "client/output/output.h"
#include "client/scene/quality.h"
#include "client/output/show.h"
#include "client/scene/view.h"

struct draw_wish {
	const char *program; /* "psr shot", for messages */
	const char *server;
	int64_t timeout;
	struct scene_wish scene;
	struct view_wish view;
	struct quality_wish quality;
	const char *cameras, *replay;
	/* a turntable */
	int64_t n_turn;      /* frames a turn; 0: no turntable */
	double seconds;      /* a turn of an animation */
	/* outputs */
	const char *output, *depth, *report, *plane_text, *show_text;
	uint32_t sheet[2]; /* columns and rows; 0: none */
	int hash, effects, has_sheet;
};

void draw_wish_init(struct draw_wish *wish, const char *program);
void draw_wish_fini(struct draw_wish *wish);

/* Options of both commands, group by group. */
void draw_add_model_options(struct optlist *list, struct draw_wish *wish);
void draw_add_picture_options(struct optlist *list, struct draw_wish *wish); /* camera, light, quality */
void draw_add_file_options(struct optlist *list, struct draw_wish *wish); /* depth, report, sheet */
void draw_add_developer_options(struct optlist *list, struct draw_wish *wish);

/* Checks all of it, connects, draws, writes. */
int draw(struct draw_wish *wish, struct psr_error *err);

#endif
