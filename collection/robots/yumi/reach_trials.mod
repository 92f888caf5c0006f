MODULE ReachTrials
    ! Serves one arm and its hand: load it into T_ROB_R and into T_ROB_L, main being the entry.
    !
    ! The computer writes reach_request in one piece; its last field, seal, repeats seq, so that a
    ! request torn in transit is never started. This program answers in reach_reply: busy while a
    ! request is served, done at its end, error 0 or why it failed. A request that arrives twice
    ! with the same seq is served once. The computer never sends an arm angle or a configuration:
    ! CalcRobT makes them here from the joints it sends, whatever definition this controller uses.

    RECORD reachrequest
        num seq;
        num command;
        jointtarget joints;
        pose goal;
        num speed;
        num turn;
        num zone;
        num supervision;
        num jaw;
        num force;
        num seal;
    ENDRECORD

    RECORD reachreply
        num seq;
        bool busy;
        bool done;
        num error;
        num jaw;
        bool calibrated;
    ENDRECORD

    ! What a request may ask for.
    LOCAL CONST num PING:=1;
    LOCAL CONST num MOVE_JOINTS:=2;
    LOCAL CONST num MOVE_POSE_JOINT:=3;
    LOCAL CONST num MOVE_POSE_LINEAR:=4;
    LOCAL CONST num JAW_OPEN:=5;
    LOCAL CONST num JAW_TO:=6;
    LOCAL CONST num JAW_GRIP:=7;
    LOCAL CONST num JAW_CALIBRATE:=8;

    ! What a reply may report.
    LOCAL CONST num OK:=0;
    LOCAL CONST num UNREACHABLE:=1;
    LOCAL CONST num JOINT_LIMIT:=2;
    LOCAL CONST num COLLISION:=3;
    LOCAL CONST num HAND_NOT_CALIBRATED:=4;
    LOCAL CONST num HAND_FAULT:=5;
    LOCAL CONST num UNKNOWN_COMMAND:=6;
    LOCAL CONST num RESTARTED:=7;
    LOCAL CONST num OTHER_FAULT:=8;

    ! Between two readings of the jaws, also while the arm moves [s].
    LOCAL CONST num OBSERVATION_PERIOD:=0.1;
    ! After a collision the arm lifts off by so much [mm], so slowly.
    LOCAL CONST num RETREAT_HEIGHT:=50;
    LOCAL CONST speeddata RETREAT_SPEED:=[50,30,200,30];

    ! TASK: a plain PERS of the same name would be one and the same in both arms' tasks.
    TASK PERS string reach_version:="1";
    TASK PERS reachrequest reach_request:=[0,0,[[0,0,0,0,0,0],[0,9E+09,9E+09,9E+09,9E+09,9E+09]],[[0,0,0],[1,0,0,0]],0,0,0,0,0,0,0];
    TASK PERS reachreply reach_reply:=[0,FALSE,TRUE,0,0,FALSE];
    ! Position of one jaw [mm], kept fresh while the program runs; -1 if the hand cannot be read.
    TASK PERS num reach_jaw:=-1;
    ! The gripper's frame is tool0; mass [kg] and center of mass [mm] are the hand's.
    TASK PERS tooldata reach_tool:=[TRUE,[[0,0,0],[1,0,0,0]],[0.23,[8.2,11.7,52],[1,0,0,0],0.00021,0.00024,0.00009]];

    ! The request being served: a copy, because the computer may already write the next one.
    LOCAL VAR reachrequest current;
    LOCAL VAR num failure:=0;
    LOCAL VAR intnum observation;

    PROC main()
        IDelete observation;
        CONNECT observation WITH Observe;
        ITimer OBSERVATION_PERIOD,observation;
        ConfJ\Off;
        ConfL\Off;
        Forget;
        WHILE TRUE DO
            WaitUntil reach_request.seal=reach_request.seq AND reach_request.seq<>reach_reply.seq;
            Serve;
        ENDWHILE
    ENDPROC

    ! What was asked before the program pointer was set to main is not carried out.
    LOCAL PROC Forget()
        failure:=OK;
        IF reach_reply.busy OR reach_request.seq<>reach_reply.seq THEN
            failure:=RESTARTED;
        ENDIF
        current:=reach_request;
        Answer;
    ENDPROC

    LOCAL PROC Serve()
        current:=reach_request;
        failure:=OK;
        reach_reply:=[current.seq,TRUE,FALSE,OK,reach_reply.jaw,reach_reply.calibrated];
        Execute;
        IF failure=COLLISION THEN
            Retreat;
        ENDIF
        Answer;
    ERROR
        ! An error while retreating does not hide the collision.
        IF failure=OK THEN
            failure:=FailureOf(ERRNO);
        ENDIF
        IF ERRNO=ERR_COLL_STOP THEN
            StopMove\Quick;
            ClearPath;
            StartMove;
        ENDIF
        TRYNEXT;
    ENDPROC

    ! A hand that cannot be read must not keep the reply back.
    LOCAL PROC Answer()
        VAR num jaw:=-1;
        VAR bool calibrated:=FALSE;

        calibrated:=Hand_IsCalibrated();
        jaw:=Hand_GetActualPos();
        reach_reply:=[current.seq,FALSE,TRUE,failure,jaw,calibrated];
    ERROR
        TRYNEXT;
    ENDPROC

    LOCAL TRAP Observe
        reach_jaw:=Hand_GetActualPos();
    ERROR
        reach_jaw:=-1;
        RETURN;
    ENDTRAP

    LOCAL PROC Execute()
        TEST current.command
        CASE PING:
            failure:=OK;
        CASE MOVE_JOINTS,MOVE_POSE_JOINT,MOVE_POSE_LINEAR:
            Move;
        CASE JAW_OPEN:
            Hand_SetMaxSpeed current.speed;
            Hand_GripOutward;
        CASE JAW_TO:
            Hand_SetMaxSpeed current.speed;
            Hand_MoveTo current.jaw;
        CASE JAW_GRIP:
            Hand_SetMaxSpeed current.speed;
            Hand_GripInward\holdForce:=current.force;
        CASE JAW_CALIBRATE:
            Hand_Initialize\maxSpd:=current.speed\holdForce:=current.force\Calibrate;
        DEFAULT:
            failure:=UNKNOWN_COMMAND;
        ENDTEST
    ENDPROC

    LOCAL PROC Move()
        VAR robtarget target;
        VAR jointtarget solution;
        VAR speeddata speed;
        VAR zonedata zone;

        speed:=[current.speed,current.turn,200,30];
        zone:=ZoneOf(current.zone);
        MotionSup\On\TuneValue:=current.supervision;
        IF current.command=MOVE_JOINTS THEN
            MoveAbsJ current.joints\NoEOffs,speed,zone,reach_tool\WObj:=wobj0;
        ELSE
            target:=TargetOf(current.joints,current.goal);
            ! Raises ERR_ROBLIMIT or ERR_OUTSIDE_REACH before anything moves.
            solution:=CalcJointT(target,reach_tool\WObj:=wobj0);
            IF current.command=MOVE_POSE_LINEAR THEN
                MoveL target,speed,zone,reach_tool\WObj:=wobj0;
            ELSE
                MoveJ target,speed,zone,reach_tool\WObj:=wobj0;
            ENDIF
        ENDIF
    ENDPROC

    LOCAL PROC Retreat()
        MoveL Offs(CRobT(\Tool:=reach_tool\WObj:=wobj0),0,0,RETREAT_HEIGHT),RETREAT_SPEED,fine,reach_tool\WObj:=wobj0;
    ENDPROC

    ! The elbow and the configuration of the joints, the position and orientation of the goal.
    LOCAL FUNC robtarget TargetOf(jointtarget joints,pose goal)
        VAR robtarget target;

        target:=CalcRobT(joints,reach_tool\WObj:=wobj0);
        target.trans:=goal.trans;
        target.rot:=goal.rot;
        RETURN target;
    ENDFUNC

    ! A stop point for 0, else a fly-by zone of this radius [mm].
    LOCAL FUNC zonedata ZoneOf(num radius)
        VAR zonedata zone;

        zone:=fine;
        IF radius>0 THEN
            zone:=[FALSE,radius,1.5*radius,1.5*radius,0.15*radius,1.5*radius,0.15*radius];
        ENDIF
        RETURN zone;
    ENDFUNC

    LOCAL FUNC num FailureOf(errnum code)
        IF code=ERR_OUTSIDE_REACH THEN
            RETURN UNREACHABLE;
        ELSEIF code=ERR_ROBLIMIT THEN
            RETURN JOINT_LIMIT;
        ELSEIF code=ERR_COLL_STOP THEN
            RETURN COLLISION;
        ELSEIF code=ERR_HAND_NOTCALIBRATED THEN
            RETURN HAND_NOT_CALIBRATED;
        ELSEIF code=ERR_HAND_WRONGSTATE OR code=ERR_HAND_FAILEDGRIPPOS OR code=ERR_HAND_FAILEDMOVEPOS THEN
            RETURN HAND_FAULT;
        ENDIF
        RETURN OTHER_FAULT;
    ENDFUNC
ENDMODULE
